#include <immintrin.h>

#include "host/render/cpu/packet_kernels.hpp"

namespace birdseye::host::cpu {

namespace {

/// Sixteen lanes of AVX-512 (F, BW, DQ, VL). The compiler's operators on vectors are used for floats.
struct Avx512 {
  static constexpr int kLanes = 16;
  using F = __m512;
  using I = __m512i;
  using M = __mmask16;

  static F f(float value) { return _mm512_set1_ps(value); }
  static I i(int value) { return _mm512_set1_epi32(value); }
  static F iota() { return _mm512_setr_ps(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15); }
  static F load(const float* at) { return _mm512_loadu_ps(at); }
  static I load_bits(const std::uint32_t* at) { return _mm512_loadu_si512(at); }
  static void store(std::uint32_t* at, I v) { _mm512_store_si512(at, v); }
  static void store_first(std::uint32_t* at, I v, int count) {
    _mm512_mask_storeu_epi32(at, static_cast<M>(count >= kLanes ? 0xFFFF : (1 << count) - 1), v);
  }

  static F min(F a, F b) { return _mm512_min_ps(a, b); }
  static F max(F a, F b) { return _mm512_max_ps(a, b); }
  static I min(I a, I b) { return _mm512_min_epi32(a, b); }
  static I max(I a, I b) { return _mm512_max_epi32(a, b); }
  static F abs(F a) { return _mm512_abs_ps(a); }
  static F sqrt(F a) { return _mm512_sqrt_ps(a); }
  static F ceil(F a) { return _mm512_roundscale_ps(a, _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC); }
  static F floor(F a) { return _mm512_roundscale_ps(a, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC); }
  static I truncate(F a) { return _mm512_cvttps_epi32(a); }
  static I round(F a) { return _mm512_cvtps_epi32(a); }
  static F to_float(I a) { return _mm512_cvtepi32_ps(a); }
  static F as_float(I a) { return _mm512_castsi512_ps(a); }

  static I add(I a, I b) { return _mm512_add_epi32(a, b); }
  static I multiply(I a, I b) { return _mm512_mullo_epi32(a, b); }
  static I intersect(I a, I b) { return _mm512_and_si512(a, b); }
  static I unite(I a, I b) { return _mm512_or_si512(a, b); }
  template <int Bits>
  static I shift_left(I a) {
    return _mm512_slli_epi32(a, Bits);
  }
  template <int Bits>
  static I shift_right(I a) {
    return _mm512_srai_epi32(a, Bits);
  }

  static M lt(F a, F b) { return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ); }
  static M le(F a, F b) { return _mm512_cmp_ps_mask(a, b, _CMP_LE_OQ); }
  static M both(M a, M b) { return static_cast<M>(a & b); }
  static float least(F a) { return _mm512_reduce_min_ps(a); }
  static bool any(M m) { return m != 0; }
  static F select(M m, F a, F b) { return _mm512_mask_mov_ps(b, m, a); }

  static F gather(const float* base, I index) { return _mm512_i32gather_ps(index, base, 4); }
  static I gather_byte(const std::uint8_t* base, I index, M m) {
    return intersect(_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), m, index, base, 1), i(255));
  }
  static I gather_halves(const std::int16_t* base, I index, M m) {
    return _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), m, index, base, 2);
  }
  static void gather_pair(const std::uint64_t* base, I index, M m, I& low, I& high) {
    const I zero = _mm512_setzero_si512();
    const I a = _mm512_mask_i32gather_epi64(zero, static_cast<__mmask8>(m), _mm512_castsi512_si256(index), base, 8);
    const I b =
        _mm512_mask_i32gather_epi64(zero, static_cast<__mmask8>(m >> 8), _mm512_extracti64x4_epi64(index, 1), base, 8);
    low = _mm512_permutex2var_epi32(a, evens(), b);
    high = _mm512_permutex2var_epi32(a, odds(), b);
  }

  /// In the cell of voxel `index`, at x, y, z of 32768 in it: HU as an entry of the transfer function, shade (of 1023)
  /// and highlight (of 1). Two voxels side by side come with one load. HU are blended with weights of 14 bits along x
  /// and z and of 15 along y, and kept to an eighth; light with 7 bits along x and 15 along y and z.
  static void sample(const GridView& grid, I index, I x, I y, I z, M m, I& entry, F& shade, F& highlight) {
    const I zero = _mm512_setzero_si512();
    const __m256i first = _mm512_castsi512_si256(index);
    const __m256i second = _mm512_extracti64x4_epi64(index, 1);
    const auto m1 = static_cast<__mmask8>(m);
    const auto m2 = static_cast<__mmask8>(m >> 8);
    // HU HU' | shade shade' highlight highlight', of the two voxels.
    const I order = _mm512_broadcast_i32x4(_mm_setr_epi8(0, 1, 4, 5, 2, 6, 3, 7, 8, 9, 12, 13, 10, 14, 11, 15));
    const I both = _mm512_broadcast_i32x4(_mm_setr_epi8(0, 1, 0, 1, 4, 5, 4, 5, 8, 9, 8, 9, 12, 13, 12, 13));
    const auto pair_weights = [](I part) {
      const I w = _mm512_srli_epi32(part, 1);
      return _mm512_add_epi32(i(16384), _mm512_sub_epi32(_mm512_slli_epi32(w, 16), w));
    };
    const I value_weights = pair_weights(x);
    // 127 - w and w, twice: in 16 bits, 127 + 255 w.
    const I light_weights = _mm512_add_epi16(
        _mm512_set1_epi16(127),
        _mm512_mullo_epi16(_mm512_shuffle_epi8(_mm512_srli_epi32(x, 8), both), _mm512_set1_epi16(255)));
    I values[4];
    I lights[4];
    for (int n = 0; n < 4; ++n) {
      const std::uint32_t* const base = grid.voxels + (n & 1) * grid.row + (n >> 1) * grid.slice;
      const I a = _mm512_shuffle_epi8(_mm512_mask_i32gather_epi64(zero, m1, first, base, 4), order);
      const I b = _mm512_shuffle_epi8(_mm512_mask_i32gather_epi64(zero, m2, second, base, 4), order);
      values[n] = _mm512_madd_epi16(_mm512_permutex2var_epi32(a, evens(), b), value_weights);
      lights[n] = _mm512_maddubs_epi16(_mm512_permutex2var_epi32(a, odds(), b), light_weights);
    }
    const I wy = _mm512_shuffle_epi8(y, both);
    const I wz = _mm512_shuffle_epi8(z, both);
    const auto blend = [](I a, I b, I t) {
      return _mm512_add_epi16(a, _mm512_mulhrs_epi16(_mm512_sub_epi16(b, a), t));
    };
    // Both rows of a slice in one: eighths of HU in 16 bits each.
    const auto halves = [](I low, I high) {
      return _mm512_mask_blend_epi16(0xAAAAAAAA, _mm512_srli_epi32(low, 11), _mm512_slli_epi32(high, 5));
    };
    const I slices = blend(halves(values[0], values[2]), halves(values[1], values[3]), wy);
    entry = _mm512_srli_epi32(_mm512_add_epi32(_mm512_madd_epi16(slices, pair_weights(z)), i(1 << 16)), 17);
    const I lit = blend(blend(lights[0], lights[1], wy), blend(lights[2], lights[3], wy), wz);
    constexpr float kUnit = 1.0F / (255 * 127);
    shade = to_float(intersect(lit, i(0xFFFF))) * f(kUnit / 1023);
    highlight = to_float(_mm512_srli_epi32(lit, 16)) * f(kUnit);
  }

 private:
  static I evens() { return _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30); }
  static I odds() { return _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31); }
};

constexpr Kernels kKernels = make_kernels<Avx512>();

}  // namespace

const Kernels& avx512_kernels() {
  return kKernels;
}

}  // namespace birdseye::host::cpu
