#include "drivers/video/pixel_rows.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

// Loops of a fixed length over small arrays, without branches: compilers turn every one of them into vector
// instructions, those of the machine's baseline, or AVX2 where the processor has it (asked once, at run time).

namespace birdseye::drivers {

namespace {

static_assert(std::endian::native == std::endian::little);

#define ALWAYS_INLINE [[gnu::always_inline]] inline

constexpr std::size_t kPairs = 32;  // of pixels, done at a time in arrays that stay in the first-level cache
constexpr std::size_t kPiece = 2 * kPairs;

using PieceBytes = std::array<std::uint8_t, kPiece>;
/// Both bytes of a pair in one number, the first in the lower half.
using Pairs = std::array<std::uint16_t, kPairs>;

ALWAYS_INLINE Pairs pairs_of(const std::uint8_t* bytes) {
  Pairs pairs;
  std::memcpy(pairs.data(), bytes, sizeof pairs);
  return pairs;
}

/// The first and the second byte of every two.
ALWAYS_INLINE void split(const std::uint8_t* in, PieceBytes& first, PieceBytes& second) {
  for (std::size_t i = 0; i < kPiece; ++i) {
    first[i] = in[2 * i];
    second[i] = in[2 * i + 1];
  }
}

/// value * factor / 8192, in sixteenths; value is a byte more or less 128 or so.
ALWAYS_INLINE std::int16_t scaled(int value, std::int16_t factor) {
  const auto shifted = static_cast<std::int16_t>(value << 7);
  return static_cast<std::int16_t>((shifted * factor) >> 16);
}
ALWAYS_INLINE std::uint16_t to_byte(int sixteenths) {
  const auto whole = static_cast<std::int16_t>(static_cast<std::int16_t>(sixteenths) >> 4);
  return static_cast<std::uint16_t>(std::clamp<std::int16_t>(whole, 0, 255));
}
ALWAYS_INLINE std::uint16_t pair(std::uint16_t first, std::uint16_t second) {
  return static_cast<std::uint16_t>(first | second << 8U);
}

struct Planes {
  Pairs r, g, b;
};

ALWAYS_INLINE void mix(const Pairs& luma, const Pairs& chroma, const YuvMatrix& matrix, Planes& out) {
  const YuvMatrix m = matrix;
  for (std::size_t i = 0; i < kPairs; ++i) {
    const std::int16_t u = static_cast<std::int16_t>((chroma[i] & 0xffU) - 128);
    const std::int16_t v = static_cast<std::int16_t>((chroma[i] >> 8U) - 128);
    const int red = scaled(v, m.red_of_v) + 8;  // 8: to the nearest
    const int green = scaled(u, m.green_of_u) + scaled(v, m.green_of_v) + 8;
    const int blue = scaled(u, m.blue_of_u) + 8;
    const int first = scaled(static_cast<int>(luma[i] & 0xffU) - m.black, m.luma);
    const int second = scaled(static_cast<int>(luma[i] >> 8U) - m.black, m.luma);
    out.r[i] = pair(to_byte(first + red), to_byte(second + red));
    out.g[i] = pair(to_byte(first + green), to_byte(second + green));
    out.b[i] = pair(to_byte(first + blue), to_byte(second + blue));
  }
}

ALWAYS_INLINE void interleave(const Planes& in, std::uint8_t* rgb) {
  PieceBytes r;
  PieceBytes g;
  PieceBytes b;
  std::memcpy(r.data(), in.r.data(), sizeof r);
  std::memcpy(g.data(), in.g.data(), sizeof g);
  std::memcpy(b.data(), in.b.data(), sizeof b);
  for (std::size_t i = 0; i < kPiece; ++i) {
    rgb[3 * i] = r[i];
    rgb[3 * i + 1] = g[i];
    rgb[3 * i + 2] = b[i];
  }
}

ALWAYS_INLINE void piece_to_rgb(const std::uint8_t* luma, const std::uint8_t* chroma, YuvPacking packing,
                                const YuvMatrix& matrix, std::uint8_t* rgb) {
  PieceBytes y;
  PieceBytes uv;
  if (packing == YuvPacking::luma_first) split(luma, y, uv);
  if (packing == YuvPacking::chroma_first) split(luma, uv, y);
  const bool packed = packing != YuvPacking::two_planes;
  Planes planes;
  mix(pairs_of(packed ? y.data() : luma), pairs_of(packed ? uv.data() : chroma), matrix, planes);
  interleave(planes, rgb);
}

ALWAYS_INLINE void yuv_row(const std::uint8_t* luma, const std::uint8_t* chroma, int width_px, YuvPacking packing,
                           const YuvMatrix& matrix, std::uint8_t* rgb) {
  const auto width = static_cast<std::size_t>(width_px);
  const bool planar = packing == YuvPacking::two_planes;
  const std::size_t luma_bytes = planar ? 1 : 2;
  std::size_t x = 0;
  for (; x + kPiece <= width; x += kPiece) {
    piece_to_rgb(luma + x * luma_bytes, planar ? chroma + x : luma, packing, matrix, rgb + 3 * x);
  }
  if (x == width) return;
  // The rest, padded: rows end in a whole pair of pixels.
  const std::size_t left = width - x;
  const std::size_t even = left + left % 2;
  std::array<std::uint8_t, 2 * kPiece> last_luma{};
  std::array<std::uint8_t, kPiece> last_chroma{};
  std::array<std::uint8_t, 3 * kPiece> last_rgb;
  std::memcpy(last_luma.data(), luma + x * luma_bytes, planar ? left : 2 * even);
  if (planar) std::memcpy(last_chroma.data(), chroma + x, even);
  piece_to_rgb(last_luma.data(), last_chroma.data(), packing, matrix, last_rgb.data());
  std::memcpy(rgb + 3 * x, last_rgb.data(), 3 * left);
}

ALWAYS_INLINE void bgr_row(const std::uint8_t* bgr, int width_px, std::uint8_t* rgb) {
  for (std::size_t x = 0; x < static_cast<std::size_t>(width_px); ++x) {
    rgb[3 * x] = bgr[3 * x + 2];
    rgb[3 * x + 1] = bgr[3 * x + 1];
    rgb[3 * x + 2] = bgr[3 * x];
  }
}

ALWAYS_INLINE void grey_row(const std::uint8_t* grey, int width_px, std::uint8_t* rgb) {
  for (std::size_t x = 0; x < static_cast<std::size_t>(width_px); ++x) {
    rgb[3 * x] = rgb[3 * x + 1] = rgb[3 * x + 2] = grey[x];
  }
}

#ifdef __x86_64__
[[gnu::target("avx2")]] void yuv_row_avx2(const std::uint8_t* luma, const std::uint8_t* chroma, int width_px,
                                          YuvPacking packing, const YuvMatrix& matrix, std::uint8_t* rgb) {
  yuv_row(luma, chroma, width_px, packing, matrix, rgb);
}
[[gnu::target("avx2")]] void bgr_row_avx2(const std::uint8_t* bgr, int width_px, std::uint8_t* rgb) {
  bgr_row(bgr, width_px, rgb);
}
[[gnu::target("avx2")]] void grey_row_avx2(const std::uint8_t* grey, int width_px, std::uint8_t* rgb) {
  grey_row(grey, width_px, rgb);
}
const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;
#endif

}  // namespace

void yuv_row_to_rgb(const std::uint8_t* luma, const std::uint8_t* chroma, int width_px, YuvPacking packing,
                    const YuvMatrix& matrix, std::uint8_t* rgb) {
#ifdef __x86_64__
  if (has_avx2) return yuv_row_avx2(luma, chroma, width_px, packing, matrix, rgb);
#endif
  yuv_row(luma, chroma, width_px, packing, matrix, rgb);
}

void bgr_row_to_rgb(const std::uint8_t* bgr, int width_px, std::uint8_t* rgb) {
#ifdef __x86_64__
  if (has_avx2) return bgr_row_avx2(bgr, width_px, rgb);
#endif
  bgr_row(bgr, width_px, rgb);
}

void grey_row_to_rgb(const std::uint8_t* grey, int width_px, std::uint8_t* rgb) {
#ifdef __x86_64__
  if (has_avx2) return grey_row_avx2(grey, width_px, rgb);
#endif
  grey_row(grey, width_px, rgb);
}

}  // namespace birdseye::drivers
