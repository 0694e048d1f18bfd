#include <immintrin.h>

#include "host/render/cpu/packet_kernels.hpp"

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
  static void gather_pair(const std::uint64_t* base, I index, M m, I& low, I& high) {
    const Pairs p = gather_64<8>(base, index, m);
    low = evens(p);
    high = odds(p);
  }

  static void sample(const GridView& grid, I index, I x, I y, I z, M m, I& entry, F& shade, F& highlight) {
    // HU HU' | shade shade' highlight highlight', of the two voxels.
    const I order = _mm256_broadcastsi128_si256(_mm_setr_epi8(0, 1, 4, 5, 2, 6, 3, 7, 8, 9, 12, 13, 10, 14, 11, 15));
    const I both = _mm256_broadcastsi128_si256(_mm_setr_epi8(0, 1, 0, 1, 4, 5, 4, 5, 8, 9, 8, 9, 12, 13, 12, 13));
    const auto pair_weights = [](I part) {
      const I w = _mm256_srli_epi32(part, 1);
      return _mm256_add_epi32(i(16384), _mm256_sub_epi32(_mm256_slli_epi32(w, 16), w));
    };
    const I value_weights = pair_weights(x);
    // 127 - w and w, twice: in 16 bits, 127 + 255 w.
    const I light_weights = _mm256_add_epi16(
        _mm256_set1_epi16(127),
        _mm256_mullo_epi16(_mm256_shuffle_epi8(_mm256_srli_epi32(x, 8), both), _mm256_set1_epi16(255)));
    I values[4];
    I lights[4];
    for (int n = 0; n < 4; ++n) {
      const std::uint32_t* const base = grid.voxels + (n & 1) * grid.row + (n >> 1) * grid.slice;
      Pairs p = gather_64<4>(base, index, m);
      p.first = _mm256_shuffle_epi8(p.first, order);
      p.second = _mm256_shuffle_epi8(p.second, order);
      values[n] = _mm256_madd_epi16(evens(p), value_weights);
      lights[n] = _mm256_maddubs_epi16(odds(p), light_weights);
    }
    const I wy = _mm256_shuffle_epi8(y, both);
    const I wz = _mm256_shuffle_epi8(z, both);
    const auto blend = [](I a, I b, I t) {
      return _mm256_add_epi16(a, _mm256_mulhrs_epi16(_mm256_sub_epi16(b, a), t));
    };
    // Both rows of a slice in one: eighths of HU in 16 bits each.
    const auto halves = [](I low, I high) {
      return _mm256_blend_epi16(_mm256_srli_epi32(low, 11), _mm256_slli_epi32(high, 5), 0xAA);
    };
    const I slices = blend(halves(values[0], values[2]), halves(values[1], values[3]), wy);
    entry = _mm256_srli_epi32(_mm256_add_epi32(_mm256_madd_epi16(slices, pair_weights(z)), i(1 << 16)), 17);
    const I lit = blend(blend(lights[0], lights[1], wy), blend(lights[2], lights[3], wy), wz);
    constexpr float kUnit = 1.0F / (255 * 127);
    shade = to_float(intersect(lit, i(0xFFFF))) * f(kUnit / 1023);
    highlight = to_float(_mm256_srli_epi32(lit, 16)) * f(kUnit);
  }

 private:
  struct Pairs {
    I first, second;  ///< of lanes 0 to 3 and 4 to 7
  };
  template <int Scale, typename T>
  static Pairs gather_64(const T* base, I index, M m) {
    const auto* const at = reinterpret_cast<const long long*>(base);
    const I zero = _mm256_setzero_si256();
    return {_mm256_mask_i32gather_epi64(zero, at, _mm256_castsi256_si128(index),
                                        _mm256_cvtepi32_epi64(_mm256_castsi256_si128(m.lanes)), Scale),
            _mm256_mask_i32gather_epi64(zero, at, _mm256_extracti128_si256(index, 1),
                                        _mm256_cvtepi32_epi64(_mm256_extracti128_si256(m.lanes, 1)), Scale)};
  }
  template <int Which>
  static I every_other(const Pairs& p) {
    const __m256 picked = _mm256_shuffle_ps(_mm256_castsi256_ps(p.first), _mm256_castsi256_ps(p.second), Which);
    return _mm256_permute4x64_epi64(_mm256_castps_si256(picked), 0xD8);
  }
  static I evens(const Pairs& p) { return every_other<0x88>(p); }
  static I odds(const Pairs& p) { return every_other<0xDD>(p); }
};

constexpr Kernels kKernels = make_kernels<Avx2>();

}  // namespace

const Kernels& avx2_kernels() {
  return kKernels;
}

}  // namespace birdseye::host::cpu
