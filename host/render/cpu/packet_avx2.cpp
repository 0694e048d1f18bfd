#include <immintrin.h>

#include "host/render/cpu/packet_kernels.hpp"
#include "host/render/cpu/packet_sample.hpp"

namespace birdseye::host::cpu {

namespace {

/// Eight lanes of AVX2 and FMA. As Avx512, step by step; only the shuffles are others.
struct Avx2 {
  static constexpr int kLanes = 8;
  using F = __m256;
  using I = __m256i;
  struct M {
    __m256i lanes;  ///< all bits or none
  };

  static F f(float value) { return _mm256_set1_ps(value); }
  static I i(int value) { return _mm256_set1_epi32(value); }
  static F iota() { return _mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7); }
  static F load(const float* at) { return _mm256_loadu_ps(at); }
  static I load_bits(const std::uint32_t* at) { return _mm256_loadu_si256(reinterpret_cast<const I*>(at)); }
  static void store(std::uint32_t* at, I v) { _mm256_store_si256(reinterpret_cast<I*>(at), v); }
  static void store_first(std::uint32_t* at, I v, int count) {
    const I lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    _mm256_maskstore_epi32(reinterpret_cast<int*>(at), _mm256_cmpgt_epi32(i(count), lane), v);
  }

  static F min(F a, F b) { return _mm256_min_ps(a, b); }
  static F max(F a, F b) { return _mm256_max_ps(a, b); }
  static I min(I a, I b) { return _mm256_min_epi32(a, b); }
  static I max(I a, I b) { return _mm256_max_epi32(a, b); }
  static F abs(F a) { return _mm256_andnot_ps(f(-0.0F), a); }
  static F sqrt(F a) { return _mm256_sqrt_ps(a); }
  static F ceil(F a) { return _mm256_ceil_ps(a); }
  static F floor(F a) { return _mm256_floor_ps(a); }
  static I truncate(F a) { return _mm256_cvttps_epi32(a); }
  static I round(F a) { return _mm256_cvtps_epi32(a); }
  static F to_float(I a) { return _mm256_cvtepi32_ps(a); }
  static F as_float(I a) { return _mm256_castsi256_ps(a); }

  static I add(I a, I b) { return _mm256_add_epi32(a, b); }
  static I subtract(I a, I b) { return _mm256_sub_epi32(a, b); }
  static I multiply(I a, I b) { return _mm256_mullo_epi32(a, b); }
  static I intersect(I a, I b) { return _mm256_and_si256(a, b); }
  static I unite(I a, I b) { return _mm256_or_si256(a, b); }
  template <int Bits>
  static I shift_left(I a) {
    return _mm256_slli_epi32(a, Bits);
  }
  template <int Bits>
  static I shift_right(I a) {
    return _mm256_srai_epi32(a, Bits);
  }

  static M lt(F a, F b) { return {_mm256_castps_si256(_mm256_cmp_ps(a, b, _CMP_LT_OQ))}; }
  static M le(F a, F b) { return {_mm256_castps_si256(_mm256_cmp_ps(a, b, _CMP_LE_OQ))}; }
  static M both(M a, M b) { return {_mm256_and_si256(a.lanes, b.lanes)}; }
  static float least(F a) {
    __m128 b = _mm_min_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps(a, 1));
    b = _mm_min_ps(b, _mm_movehl_ps(b, b));
    return _mm_cvtss_f32(_mm_min_ss(b, _mm_movehdup_ps(b)));
  }
  static bool any(M m) { return _mm256_testz_si256(m.lanes, m.lanes) == 0; }
  static F select(M m, F a, F b) { return _mm256_blendv_ps(b, a, _mm256_castsi256_ps(m.lanes)); }

  static F gather(const float* base, I index) { return _mm256_i32gather_ps(base, index, 4); }
  static I gather_byte(const std::uint8_t* base, I index, M m) {
    return intersect(
        _mm256_mask_i32gather_epi32(_mm256_setzero_si256(), reinterpret_cast<const int*>(base), index, m.lanes, 1),
        i(255));
  }
  static I gather_halves(const std::int16_t* base, I index, M m) {
    return _mm256_mask_i32gather_epi32(_mm256_setzero_si256(), reinterpret_cast<const int*>(base), index, m.lanes, 2);
  }
  using Blended = BlendedBytes<Avx2>;
  static Blended blend(const GridView& grid, I x, I y, I z, M m) { return blend_bytes<Avx2>(grid, x, y, z, m); }
  static Sample<Avx2> classify(const std::uint64_t* transfer, const Blended& blended) {
    return classify_bytes<Avx2>(transfer, blended);
  }

  // For blend_bytes: lanes 0, 1, 4, 5 are the first half, 2, 3, 6, 7 the second, as shuffle_ps has them.
  struct Halves {
    __m128i first, second;
  };
  static Halves halves(I index) {
    const I split = _mm256_permutevar8x32_epi32(index, _mm256_setr_epi32(0, 1, 4, 5, 2, 3, 6, 7));
    return {_mm256_castsi256_si128(split), _mm256_extracti128_si256(split, 1)};
  }
  static I gather_64(const std::uint32_t* base, __m128i index) {
    return _mm256_i32gather_epi64(reinterpret_cast<const long long*>(base), index, 4);
  }
  static I gather_table(const std::uint64_t* base, I index) {
    return _mm256_i64gather_epi64(reinterpret_cast<const long long*>(base), index, 8);
  }
  static I evens(I first, I second) { return shuffled<0x88>(first, second); }
  static I odds(I first, I second) { return shuffled<0xDD>(first, second); }
  static I keep(M m, I a) { return _mm256_and_si256(m.lanes, a); }
  static I bytes(__m128i pattern) { return _mm256_broadcastsi128_si256(pattern); }
  static I i_16(short value) { return _mm256_set1_epi16(value); }
  static I i_64(long long value) { return _mm256_set1_epi64x(value); }
  static I shuffle(I a, I pattern) { return _mm256_shuffle_epi8(a, pattern); }
  static I half_16(I a) { return _mm256_srli_epi16(a, 1); }
  static I add_16(I a, I b) { return _mm256_add_epi16(a, b); }
  static I subtract_16(I a, I b) { return _mm256_sub_epi16(a, b); }
  static I multiply_16(I a, I b) { return _mm256_mullo_epi16(a, b); }
  static I scale_16(I a, I b) { return _mm256_mulhrs_epi16(a, b); }
  static I multiply_add(I a, I b) { return _mm256_madd_epi16(a, b); }
  static I multiply_add_bytes(I a, I b) { return _mm256_maddubs_epi16(a, b); }
  template <int Bits>
  static I shift_right_64(I a) {
    return _mm256_srli_epi64(a, Bits);
  }

 private:
  template <int Which>
  static I shuffled(I first, I second) {
    return _mm256_castps_si256(_mm256_shuffle_ps(_mm256_castsi256_ps(first), _mm256_castsi256_ps(second), Which));
  }
};

constexpr Kernels kKernels = make_kernels<Avx2>();

}  // namespace

const Kernels& avx2_kernels() {
  return kKernels;
}

}  // namespace birdseye::host::cpu
