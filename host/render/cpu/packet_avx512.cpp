#include <immintrin.h>

#include "host/render/cpu/packet_kernels.hpp"
#include "host/render/cpu/packet_sample.hpp"

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
  static I subtract(I a, I b) { return _mm512_sub_epi32(a, b); }
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
  using Blended = BlendedBytes<Avx512>;
  static Blended blend(const GridView& grid, I x, I y, I z, M m) { return blend_bytes<Avx512>(grid, x, y, z, m); }
  static Sample<Avx512> classify(const std::uint64_t* transfer, const Blended& blended) {
    return classify_bytes<Avx512>(transfer, blended);
  }

  // For blend_bytes: lanes 0, 1, 4, 5, ... are the first half, 2, 3, 6, 7, ... the second, as shuffle_ps has them.
  struct Halves {
    __m256i first, second;
  };
  static Halves halves(I index) {
    const I order = _mm512_setr_epi32(0, 1, 4, 5, 8, 9, 12, 13, 2, 3, 6, 7, 10, 11, 14, 15);
    const I split = _mm512_permutexvar_epi32(order, index);
    return {_mm512_castsi512_si256(split), _mm512_extracti64x4_epi64(split, 1)};
  }
  static I gather_64(const std::uint32_t* base, __m256i index) { return _mm512_i32gather_epi64(index, base, 4); }
  static I gather_table(const std::uint64_t* base, I index) { return _mm512_i64gather_epi64(index, base, 8); }
  static I evens(I first, I second) { return shuffled<0x88>(first, second); }
  static I odds(I first, I second) { return shuffled<0xDD>(first, second); }
  static I keep(M m, I a) { return _mm512_maskz_mov_epi32(m, a); }
  static I bytes(__m128i pattern) { return _mm512_broadcast_i32x4(pattern); }
  static I i_16(short value) { return _mm512_set1_epi16(value); }
  static I i_64(long long value) { return _mm512_set1_epi64(value); }
  static I shuffle(I a, I pattern) { return _mm512_shuffle_epi8(a, pattern); }
  static I half_16(I a) { return _mm512_srli_epi16(a, 1); }
  static I add_16(I a, I b) { return _mm512_add_epi16(a, b); }
  static I subtract_16(I a, I b) { return _mm512_sub_epi16(a, b); }
  static I multiply_16(I a, I b) { return _mm512_mullo_epi16(a, b); }
  static I scale_16(I a, I b) { return _mm512_mulhrs_epi16(a, b); }
  static I multiply_add(I a, I b) { return _mm512_madd_epi16(a, b); }
  static I multiply_add_bytes(I a, I b) { return _mm512_maddubs_epi16(a, b); }
  template <int Bits>
  static I shift_right_64(I a) {
    return _mm512_srli_epi64(a, Bits);
  }

 private:
  template <int Which>
  static I shuffled(I first, I second) {
    return _mm512_castps_si512(_mm512_shuffle_ps(_mm512_castsi512_ps(first), _mm512_castsi512_ps(second), Which));
  }
};

constexpr Kernels kKernels = make_kernels<Avx512>();

}  // namespace

const Kernels& avx512_kernels() {
  return kKernels;
}

}  // namespace birdseye::host::cpu
