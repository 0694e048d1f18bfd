#include "host/files/packed_floats.hpp"

#include <openssl/evp.h>
#include <zlib.h>

#include <bit>
#include <cstdint>
#include <new>

namespace birdseye::host {

static_assert(std::endian::native == std::endian::little);

std::string packed_floats(std::span<const float> values) {
  uLongf bytes = ::compressBound(values.size_bytes());
  std::vector<std::uint8_t> compressed(bytes);
  if (::compress(compressed.data(), &bytes, reinterpret_cast<const Bytef*>(values.data()), values.size_bytes()) != Z_OK)
    throw std::bad_alloc();  // with room for the worst case it fails for nothing else
  std::string text((bytes + 2) / 3 * 4 + 1, '\0');
  const int length =
      EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()), compressed.data(), static_cast<int>(bytes));
  text.resize(static_cast<std::size_t>(length));
  return text;
}

Result<std::vector<float>> unpacked_floats(const std::string& text, std::size_t count) {
  const Error other{Errc::bad_format, "holds other numbers than it says"};
  std::vector<std::uint8_t> compressed(text.size() / 4 * 3 + 1);
  const int decoded = EVP_DecodeBlock(compressed.data(), reinterpret_cast<const unsigned char*>(text.data()),
                                      static_cast<int>(text.size()));
  if (decoded < 0) return other;
  // Zlib packs a thousand bytes into one and no more: no room is made for what the text cannot hold.
  constexpr std::size_t kMostPacked = 1100;
  if (count > compressed.size() * kMostPacked / sizeof(float)) return other;
  std::vector<float> values(count);
  uLongf bytes = count * sizeof(float);
  // Bytes of padding at the end are passed over.
  const int inflated =
      ::uncompress(reinterpret_cast<Bytef*>(values.data()), &bytes, compressed.data(), static_cast<uLong>(decoded));
  if (inflated != Z_OK || bytes != count * sizeof(float)) return other;
  return values;
}

}  // namespace birdseye::host
