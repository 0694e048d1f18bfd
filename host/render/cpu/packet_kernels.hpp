#pragma once

// The inner loops, over packets of rays or voxels. Packet is one of packet_{portable,avx2,avx512}.cpp, which includes
// this into a translation unit of its own that is compiled for that instruction set. Nothing of the standard library
// here: see kernels.hpp.

#include "host/render/cpu/packet_cast.hpp"
#include "host/render/cpu/packet_warp.hpp"

namespace birdseye::host::cpu {

template <typename P>
void light(const LightJob& job, int x_begin, int x_end, int y, int z) {
  using F = typename P::F;
  using I = typename P::I;
  const GridView& grid = job.grid;
  std::uint32_t* const row = grid.voxels + z * grid.slice + y * grid.row;
  const auto hu = [](const std::uint32_t* at) { return P::to_float(P::intersect(P::load_bits(at), P::i(0xFFFF))); };
  const float(*const m)[3] = job.patient_from_voxel;
  for (int x = x_begin; x < x_end; x += P::kLanes) {
    std::uint32_t* const at = row + x;
    const Vector<P> difference{hu(at + 1) - hu(at - 1), hu(at + grid.row) - hu(at - grid.row),
                               hu(at + grid.slice) - hu(at - grid.slice)};
    const Vector<P> g = times<P>(job.patient_gradient, difference);
    const F fx = P::f(static_cast<float>(x)) + P::iota();
    const auto from_eye = [&](int axis) {
      const float fixed =
          job.first_from_eye_mm[axis] + m[axis][1] * static_cast<float>(y) + m[axis][2] * static_cast<float>(z);
      return P::f(fixed) + P::f(m[axis][0]) * fx;
    };
    const Vector<P> d{from_eye(0), from_eye(1), from_eye(2)};
    const F steep = P::sqrt(dot(g, g));
    constexpr float kNone = 1e-6F;
    const F facing = P::min(P::f(1), P::abs(dot(g, d)) / P::max(steep * P::sqrt(dot(d, d)), P::f(kNone)));
    const F surface = P::min(P::f(1), steep * P::f(job.per_surface_gradient));
    const F shade = P::f(1) - surface + surface * (P::f(job.ambient) + P::f(job.diffuse) * facing);
    const F highlight = surface * P::gather(job.highlight, P::round(facing * P::f(kFacings)));
    const auto byte = [](F value) { return P::round(P::min(value, P::f(1)) * P::f(255)); };
    const I voxel =
        P::unite(P::intersect(P::load_bits(at), P::i(0xFFFF)),
                 P::unite(P::template shift_left<16>(byte(shade)), P::template shift_left<24>(byte(highlight))));
    P::store_first(at, voxel, x_end - x);
  }
}

template <typename P>
constexpr Kernels make_kernels() {
  return {cast<P>, light<P>, warp<P>, bounds<P>};
}

}  // namespace birdseye::host::cpu
