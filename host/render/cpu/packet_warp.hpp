#pragma once

// Resampling a volume by a displacement field, and what is in its bricks then. Nothing of the standard library here:
// see kernels.hpp.

#include "host/render/cpu/packet_math.hpp"

namespace birdseye::host::cpu {

/// A place along one axis of a field: the field's point before the place, and how far past that point the place is.
template <typename P>
struct LatticePlace {
  typename P::I base;
  typename P::F t;
};

template <typename P>
inline LatticePlace<P> lattice_place(typename P::F at, int size, typename P::M& inside) {
  constexpr float kRounding = 1e-4F;
  const auto last = P::f(static_cast<float>(size - 1));
  inside = P::both(inside, P::both(P::le(P::f(-kRounding), at), P::le(at, last + P::f(kRounding))));
  const typename P::F within = P::min(P::max(at, P::f(0)), last);
  const typename P::I base = P::min(P::truncate(within), P::i(size - 2));
  return {base, within - P::to_float(base)};
}

/// The volume's value at `to`, written to the voxels of a packet.
template <typename P>
inline void store_resampled(const WarpJob& job, typename P::F* to, int x, int x_end, std::uint32_t* row) {
  using F = typename P::F;
  using I = typename P::I;
  const GridView& grid = job.grid;
  typename P::M there = P::lt(P::f(static_cast<float>(x)) + P::iota(), P::f(static_cast<float>(x_end)));
  I from[3];
  for (int axis = 0; axis < 3; ++axis) {
    const auto last = P::f(static_cast<float>(grid.size[axis] - 1));
    there = P::both(there, P::both(P::le(P::f(0), to[axis]), P::le(to[axis], last)));
    const F within = P::min(P::max(to[axis], P::f(0)), last);
    // At its far faces the last cell is used, at its end.
    from[axis] = P::min(P::truncate(within), P::i(grid.size[axis] - 2));
    to[axis] = within - P::to_float(from[axis]);
  }
  const auto lerp = [](F a, F b, F t) { return a + t * (b - a); };
  const int source_row = grid.size[0];
  const int source_slice = source_row * grid.size[1];
  const I voxel =
      P::add(from[0], P::add(P::multiply(from[1], P::i(source_row)), P::multiply(from[2], P::i(source_slice))));
  const auto pair = [&](std::int64_t offset) {
    const I two = P::gather_halves(job.source + offset, voxel, there);
    const F a = P::to_float(P::template shift_right<16>(P::template shift_left<16>(two)));
    const F b = P::to_float(P::template shift_right<16>(two));
    return lerp(a, b, to[0]);
  };
  const F value = lerp(lerp(pair(0), pair(source_row), to[1]),
                       lerp(pair(source_slice), pair(source_slice + source_row), to[1]), to[2]);
  const I entry = P::add(P::round(P::select(there, value, P::f(kLowestHu))), P::i(-kLowestHu));
  const I cut = P::min(P::max(entry, P::i(0)), P::i(kHighestHu - kLowestHu));
  P::store_first(row + x, P::template shift_left<kHuBits>(cut), x_end - x);
}

/// Where the field's axes are the volume's, a whole row of voxels lies between the same four rows of the field, which
/// are blended into one first.
template <typename P>
void warp_aligned(const WarpJob& job, int x_begin, int x_end, int y, int z, std::uint32_t* row) {
  using F = typename P::F;
  using M = typename P::M;
  const float(*const m)[3] = job.lattice_from_voxel;
  const int voxel[3] = {0, y, z};
  int base[3] = {};
  float t[3] = {};
  bool row_inside = true;
  for (int axis = 1; axis < 3; ++axis) {
    const float at = job.lattice_origin[axis] + m[axis][axis] * static_cast<float>(voxel[axis]);
    const float last = static_cast<float>(job.field_size[axis] - 1);
    constexpr float kRounding = 1e-4F;
    row_inside = row_inside && at >= -kRounding && at <= last + kRounding;
    const float within = at < 0 ? 0 : at > last ? last : at;
    const int whole = static_cast<int>(within);
    base[axis] = whole < job.field_size[axis] - 2 ? whole : job.field_size[axis] - 2;
    t[axis] = within - static_cast<float>(base[axis]);
  }
  const int field_row = job.field_size[0];
  const int field_slice = field_row * job.field_size[1];
  const auto first = static_cast<std::int64_t>(base[2]) * field_slice + static_cast<std::int64_t>(base[1]) * field_row;
  float blended[3][kLongestAligned];
  for (int axis = 0; axis < 3; ++axis) {
    const float* const u = job.moves[axis] + first;
    for (int i = 0; i < field_row; ++i) {
      const float low = u[i] + t[1] * (u[i + field_row] - u[i]);
      const float* const v = u + field_slice;
      const float high = v[i] + t[1] * (v[i + field_row] - v[i]);
      blended[axis][i] = row_inside ? low + t[2] * (high - low) : 0;
    }
  }
  for (int x = x_begin; x < x_end; x += P::kLanes) {
    const F fx = P::f(static_cast<float>(x)) + P::iota();
    M inside = P::lt(fx, P::f(static_cast<float>(x_end)));
    const auto place = lattice_place<P>(P::f(job.lattice_origin[0]) + P::f(m[0][0]) * fx, job.field_size[0], inside);
    F to[3] = {fx, P::f(static_cast<float>(y)), P::f(static_cast<float>(z))};
    for (int axis = 0; axis < 3; ++axis) {
      const F a = P::gather(blended[axis], place.base);
      const F b = P::gather(blended[axis] + 1, place.base);
      to[axis] = to[axis] + P::select(inside, a + place.t * (b - a), P::f(0));
    }
    store_resampled<P>(job, to, x, x_end, row);
  }
}

template <typename P>
void warp(const WarpJob& job, int x_begin, int x_end, int y, int z) {
  using F = typename P::F;
  using I = typename P::I;
  using M = typename P::M;
  const GridView& grid = job.grid;
  std::uint32_t* const row = grid.voxels + z * grid.slice + y * grid.row;
  if (job.aligned) return warp_aligned<P>(job, x_begin, x_end, y, z, row);
  const float(*const m)[3] = job.lattice_from_voxel;
  const auto lerp = [](F a, F b, F t) { return a + t * (b - a); };
  const int field_row = job.field_size[0];
  const int field_slice = field_row * job.field_size[1];
  for (int x = x_begin; x < x_end; x += P::kLanes) {
    const F fx = P::f(static_cast<float>(x)) + P::iota();
    M inside = P::lt(fx, P::f(static_cast<float>(x_end)));
    LatticePlace<P> place[3];
    for (int axis = 0; axis < 3; ++axis) {
      const float fixed =
          job.lattice_origin[axis] + m[axis][1] * static_cast<float>(y) + m[axis][2] * static_cast<float>(z);
      place[axis] = lattice_place<P>(P::f(fixed) + P::f(m[axis][0]) * fx, job.field_size[axis], inside);
    }
    const I at = P::add(place[0].base, P::add(P::multiply(place[1].base, P::i(field_row)),
                                              P::multiply(place[2].base, P::i(field_slice))));
    F to[3] = {fx, P::f(static_cast<float>(y)), P::f(static_cast<float>(z))};
    for (int axis = 0; axis < 3; ++axis) {
      const float* const u = job.moves[axis];
      const auto along_x = [&](std::int64_t offset) {
        return lerp(P::gather(u + offset, at), P::gather(u + offset + 1, at), place[0].t);
      };
      const F move = lerp(lerp(along_x(0), along_x(field_row), place[1].t),
                          lerp(along_x(field_slice), along_x(field_slice + field_row), place[1].t), place[2].t);
      to[axis] = to[axis] + P::select(inside, move, P::f(0));
    }
    store_resampled<P>(job, to, x, x_end, row);
  }
}

template <typename P>
void bounds(const GridView& grid, int x_begin, int x_end, int y_begin, int y_end, int z_begin, int z_end, int* low,
            int* high) {
  const int count = x_end - x_begin;
  for (int i = 0; i < count; ++i) {
    low[i] = 32767;
    high[i] = -32768;
  }
  for (int z = z_begin; z < z_end; ++z) {
    for (int y = y_begin; y < y_end; ++y) {
      const std::uint32_t* const row = grid.voxels + z * grid.slice + y * grid.row + x_begin;
      for (int i = 0; i < count; ++i) {
        const int hu = static_cast<int>((row[i] & 0xFFFF) >> kHuBits) + kLowestHu;
        low[i] = hu < low[i] ? hu : low[i];
        high[i] = hu > high[i] ? hu : high[i];
      }
    }
  }
}

}  // namespace birdseye::host::cpu
