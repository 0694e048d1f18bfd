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

  static I add(I a, I b) { return a + b; }
  static I subtract(I a, I b) { return a - b; }
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
  struct Blended {
    I entry;
    F shade, highlight;
  };
  static Blended blend(const GridView& grid, I x, I y, I z, M m) {
    const auto part = [](I t) { return to_float(t & 0xFFFF) * (1.0F / 65536); };
    F value{}, shade{}, highlight{};
    for (int n = 0; n < 4; ++n) {
      I a{}, b{};
      for (int lane = 0; lane < kLanes; ++lane) {
        if (m.lanes[lane] == 0) continue;
        const std::uint32_t* const voxel = grid.voxels + (x[lane] >> 16) + ((y[lane] >> 16) + (n & 1)) * grid.row +
                                           ((z[lane] >> 16) + (n >> 1)) * grid.slice;
        a[lane] = static_cast<int>(voxel[0]);
        b[lane] = static_cast<int>(voxel[1]);
      }
      const F weight = ((n & 1) != 0 ? part(y) : 1 - part(y)) * ((n >> 1) != 0 ? part(z) : 1 - part(z));
      const auto along_x = [&](I from, I to) { return weight * (to_float(from) + part(x) * to_float(to - from)); };
      value += along_x((a & 0xFFFF) >> kHuBits, (b & 0xFFFF) >> kHuBits);
      shade += along_x((a >> 16) & 255, (b >> 16) & 255);
      highlight += along_x((a >> 24) & 255, (b >> 24) & 255);
    }
    return {round(value), shade * (1.0F / 255 / kLightUnit), highlight * (1.0F / 255 / kLightUnit)};
  }
  static Sample<Portable> classify(const std::uint64_t* transfer, const Blended& blended) {
    Sample<Portable> out;
    for (int lane = 0; lane < kLanes; ++lane) {
      const std::uint64_t both = transfer[blended.entry[lane]];
      out.opacity[lane] = __builtin_bit_cast(float, static_cast<std::uint32_t>(both));
      out.colour[lane] = static_cast<int>(both >> 32U);
    }
    out.shade = blended.shade;
    out.highlight = blended.highlight;
    return out;
  }
};

constexpr Kernels kKernels = make_kernels<Portable>();

}  // namespace

const Kernels& portable_kernels() {
  return kKernels;
}

}  // namespace birdseye::host::cpu
