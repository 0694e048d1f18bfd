#include "host/render/cpu/packet_kernels.hpp"

namespace birdseye::host::cpu {

namespace {

/// Four lanes of the compiler's own vectors, on whatever the machine has. As Avx512, step by step.
struct Portable {
  static constexpr int kLanes = 4;
  using F = float __attribute__((vector_size(16)));
  using I = int __attribute__((vector_size(16)));
  struct M {
    I lanes;  ///< -1 or 0
  };

  template <typename Lane>
  static I make(const Lane& lane) {
    I out;
    for (int n = 0; n < kLanes; ++n) out[n] = lane(n);
    return out;
  }
  template <typename Lane>
  static F make_float(const Lane& lane) {
    F out;
    for (int n = 0; n < kLanes; ++n) out[n] = lane(n);
    return out;
  }

  static F f(float value) { return F{} + value; }
  static I i(int value) { return I{} + value; }
  static F iota() { return F{0, 1, 2, 3}; }
  static F load(const float* at) {
    F out;
    __builtin_memcpy(&out, at, sizeof out);
    return out;
  }
  static I load_bits(const std::uint32_t* at) {
    I out;
    __builtin_memcpy(&out, at, sizeof out);
    return out;
  }
  static void store(std::uint32_t* at, I v) { __builtin_memcpy(at, &v, sizeof v); }
  static void store_first(std::uint32_t* at, I v, int count) {
    for (int n = 0; n < kLanes && n < count; ++n) at[n] = static_cast<std::uint32_t>(v[n]);
  }

  static F min(F a, F b) { return a < b ? a : b; }
  static F max(F a, F b) { return a > b ? a : b; }
  static I min(I a, I b) { return a < b ? a : b; }
  static I max(I a, I b) { return a > b ? a : b; }
  static F abs(F a) { return a < 0 ? -a : a; }
  static F sqrt(F a) {
    return make_float([&](int n) { return __builtin_sqrtf(a[n]); });
  }
  static F ceil(F a) {
    return make_float([&](int n) { return __builtin_ceilf(a[n]); });
  }
  static F floor(F a) {
    return make_float([&](int n) { return __builtin_floorf(a[n]); });
  }
  static I truncate(F a) {
    return make([&](int n) { return static_cast<int>(a[n] < -1e9F ? -1e9F : a[n] > 1e9F ? 1e9F : a[n]); });
  }
  static I round(F a) { return truncate(floor(a + 0.5F)); }
  static F to_float(I a) { return __builtin_convertvector(a, F); }
  static F as_float(I a) {
    F out;
    __builtin_memcpy(&out, &a, sizeof out);
    return out;
  }

  static I add(I a, I b) { return a + b; }
  static I multiply(I a, I b) { return a * b; }
  static I intersect(I a, I b) { return a & b; }
  static I unite(I a, I b) { return a | b; }
  template <int Bits>
  static I shift_left(I a) {
    return a << Bits;
  }
  template <int Bits>
  static I shift_right(I a) {
    return a >> Bits;
  }

  static M lt(F a, F b) { return {a < b}; }
  static M le(F a, F b) { return {a <= b}; }
  static M both(M a, M b) { return {a.lanes & b.lanes}; }
  static float least(F a) {
    float all = a[0];
    for (int n = 1; n < kLanes; ++n) all = a[n] < all ? a[n] : all;
    return all;
  }
  static bool any(M m) {
    int all = 0;
    for (int n = 0; n < kLanes; ++n) all |= m.lanes[n];
    return all != 0;
  }
  static F select(M m, F a, F b) { return m.lanes ? a : b; }

  static F gather(const float* base, I index) {
    return make_float([&](int n) { return base[index[n]]; });
  }
  static I gather_byte(const std::uint8_t* base, I index, M m) {
    return make([&](int n) { return m.lanes[n] != 0 ? base[index[n]] : 0; });
  }
  static I gather_halves(const std::int16_t* base, I index, M m) {
    return make([&](int n) {
      int two = 0;
      if (m.lanes[n] != 0) __builtin_memcpy(&two, base + index[n], sizeof two);
      return two;
    });
  }
  static void gather_pair(const std::uint64_t* base, I index, M m, I& low, I& high) {
    for (int n = 0; n < kLanes; ++n) {
      const std::uint64_t both = m.lanes[n] != 0 ? base[index[n]] : 0;
      low[n] = static_cast<int>(both & 0xFFFFFFFF);
      high[n] = static_cast<int>(both >> 32U);
    }
  }

  static void sample(const GridView& grid, I index, I x, I y, I z, M m, I& entry, F& shade, F& highlight) {
    const I zero = {};
    const auto part = [](I t) { return to_float(t) * (1.0F / 32768); };
    F value{};
    shade = highlight = F{};
    for (int n = 0; n < 4; ++n) {
      const std::uint32_t* const base = grid.voxels + (n & 1) * grid.row + (n >> 1) * grid.slice;
      I a = zero, b = zero;
      for (int lane = 0; lane < kLanes; ++lane) {
        if (m.lanes[lane] == 0) continue;
        a[lane] = static_cast<int>(base[index[lane]]);
        b[lane] = static_cast<int>(base[index[lane] + 1]);
      }
      const F weight = ((n & 1) != 0 ? part(y) : 1 - part(y)) * ((n >> 1) != 0 ? part(z) : 1 - part(z));
      const auto blend = [&](I from, I to) { return weight * (to_float(from) + part(x) * to_float(to - from)); };
      value += blend(a & 0xFFFF, b & 0xFFFF);
      shade += blend((a >> 16) & 255, (b >> 16) & 255);
      highlight += blend((a >> 24) & 255, (b >> 24) & 255);
    }
    entry = round(value);
    shade *= 1.0F / 255 / 1023;
    highlight *= 1.0F / 255;
  }
};

constexpr Kernels kKernels = make_kernels<Portable>();

}  // namespace

const Kernels& portable_kernels() {
  return kKernels;
}

}  // namespace birdseye::host::cpu
