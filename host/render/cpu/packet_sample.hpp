#pragma once

// A sample of every ray of a packet, by the bytes and 16-bit words that AVX2 and AVX-512 calculate with. To be included
// by their packets only.

#include "host/render/cpu/packet_math.hpp"

namespace birdseye::host::cpu {

/// HU, shade and highlight, still in the bytes that they were blended in.
template <typename P>
struct BlendedBytes {
  typename P::I words[2];  ///< of each half of the lanes: HU's low and high byte, shade and highlight, all times 127
};

/// At x, y, z in 1/65536 voxel. Two voxels side by side come with one load of 64 bits, so a packet is worked on as two
/// halves of twice as wide lanes. A lane holds a voxel's four bytes in four words: two for HU, one for shade, one for
/// highlight. All are blended alike, with weights of 7 bits along x and of 15 bits along y and z.
template <typename P>
inline BlendedBytes<P> blend_bytes(const GridView& grid, typename P::I x, typename P::I y, typename P::I z,
                                   typename P::M m) {
  using I = typename P::I;
  // HU as bytes 0 and 1, shade 2, highlight 3; of both voxels, side by side.
  const I order = P::bytes(_mm_setr_epi8(0, 4, 1, 5, 2, 6, 3, 7, 8, 12, 9, 13, 10, 14, 11, 15));
  const I spread[2] = {P::bytes(_mm_setr_epi8(0, 1, 0, 1, 0, 1, 0, 1, 4, 5, 4, 5, 4, 5, 4, 5)),
                       P::bytes(_mm_setr_epi8(8, 9, 8, 9, 8, 9, 8, 9, 12, 13, 12, 13, 12, 13, 12, 13))};
  const I whole_y = P::multiply_add(y, P::i(static_cast<int>(grid.row << 16)));
  const I whole_z = P::multiply_add(z, P::i(static_cast<int>(grid.slice / kSliceUnit << 16)));
  const I index = P::keep(
      m, P::add(P::add(P::template shift_right<16>(x), whole_y), P::template shift_left<kSliceUnitBits>(whole_z)));
  const auto at = P::halves(index);
  // 127 - w and w as bytes: in a word, 127 + 255 w.
  const I wx = P::add_16(P::i_16(127), P::multiply_16(P::scale_16(P::half_16(x), P::i_16(127)), P::i_16(255)));
  const I wy = P::half_16(y), wz = P::half_16(z);
  const auto blend = [](I a, I b, I t) { return P::add_16(a, P::scale_16(P::subtract_16(b, a), t)); };
  BlendedBytes<P> out;
  for (int half = 0; half < 2; ++half) {
    const I fx = P::shuffle(wx, spread[half]), fy = P::shuffle(wy, spread[half]), fz = P::shuffle(wz, spread[half]);
    const auto along_x = [&](std::int64_t offset) {
      const I two = P::gather_64(grid.voxels + offset, half == 0 ? at.first : at.second);
      return P::multiply_add_bytes(P::shuffle(two, order), fx);
    };
    out.words[half] = blend(blend(along_x(0), along_x(grid.row), fy),
                            blend(along_x(grid.slice), along_x(grid.slice + grid.row), fy), fz);
  }
  return out;
}

/// In units that are scaled once a pixel.
template <typename P>
inline Sample<P> classify_bytes(const std::uint64_t* transfer, const BlendedBytes<P>& blended) {
  using I = typename P::I;
  I entries[2];
  for (int half = 0; half < 2; ++half) {
    // 16 HU as low byte and high byte, times 127: 2^17 / (16 * 127) = 64.5, and 256 of it.
    const I scaled = P::multiply_add(blended.words[half], P::i_64(65 | 16513 << 16));
    entries[half] = P::gather_table(transfer, P::template shift_right_64<17>(P::add(scaled, P::i_64(1 << 16))));
  }
  const I light = P::odds(blended.words[0], blended.words[1]);
  return {P::as_float(P::evens(entries[0], entries[1])), P::odds(entries[0], entries[1]),
          P::to_float(P::intersect(light, P::i(0xFFFF))), P::to_float(P::template shift_right<16>(light))};
}

}  // namespace birdseye::host::cpu
