#pragma once

// The inner loops, over packets of rays or voxels. Packet is one of packet_{portable,avx2,avx512}.hpp, and includes
// this into a translation unit of its own that is compiled for that instruction set. Nothing of the standard library
// here: see kernels.hpp.

#include "host/render/cpu/kernels.hpp"

namespace birdseye::host::cpu {

/// Samples between two looks at the bricks and at the transmittance: their loads need not wait for one another.
inline constexpr int kRun = 4;
/// Below this, a pixel counts as opaque.
inline constexpr float kOpaque = 1.0F / 64;

template <typename P>
struct Vector {
  typename P::F x, y, z;
};

/// m v for a matrix given row by row.
template <typename P>
inline Vector<P> times(const float (*m)[3], const Vector<P>& v) {
  return {P::f(m[0][0]) * v.x + P::f(m[0][1]) * v.y + P::f(m[0][2]) * v.z,
          P::f(m[1][0]) * v.x + P::f(m[1][1]) * v.y + P::f(m[1][2]) * v.z,
          P::f(m[2][0]) * v.x + P::f(m[2][1]) * v.y + P::f(m[2][2]) * v.z};
}

template <typename P>
inline typename P::F dot(const Vector<P>& a, const Vector<P>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// 1 / d, of a d that is kept from zero.
template <typename P>
inline typename P::F reciprocal(typename P::F d) {
  constexpr float kLeast = 1e-9F;
  return P::f(1) / P::select(P::lt(P::abs(d), P::f(kLeast)), P::f(kLeast), d);
}

/// Narrows [near, far] to where a + s * rate >= 0.
template <typename P>
inline void keep_positive(typename P::F a, typename P::F rate, typename P::F& near, typename P::F& far) {
  const typename P::F s = (P::f(0) - a) * reciprocal<P>(rate);
  const typename P::M rises = P::lt(P::f(0), rate);
  near = P::select(rises, P::max(near, s), near);
  far = P::select(rises, far, P::min(far, s));
}

template <typename P>
void cast_packet(const CastJob& job, int block, int part) {
  using F = typename P::F;
  using I = typename P::I;
  using M = typename P::M;
  const GridView& grid = job.grid;
  const float* const at = job.directions + std::int64_t{48} * block + part;
  const Vector<P> in_camera{P::load(at), P::load(at + 16), P::load(at + 32)};
  const Vector<P> in_voxels = times<P>(job.voxels_from_camera, in_camera);  // per mm
  const Vector<P> o{P::f(job.origin[0]), P::f(job.origin[1]), P::f(job.origin[2])};

  F near = P::f(job.near_mm);
  F far = P::f(1e30F);
  const F* const axis_o[3] = {&o.x, &o.y, &o.z};
  const F* const axis_d[3] = {&in_voxels.x, &in_voxels.y, &in_voxels.z};
  for (int axis = 0; axis < 3; ++axis) {
    const F inverse_d = reciprocal<P>(*axis_d[axis]);
    const F a = (P::f(0) - *axis_o[axis]) * inverse_d;
    const F b = (P::f(static_cast<float>(grid.size[axis] - 1)) - *axis_o[axis]) * inverse_d;
    near = P::max(near, P::min(a, b));
    far = P::min(far, P::max(a, b));
  }
  const Vector<P> normal{P::f(job.clip_normal[0]), P::f(job.clip_normal[1]), P::f(job.clip_normal[2])};
  if (job.clip_normal[0] != 0 || job.clip_normal[1] != 0 || job.clip_normal[2] != 0) {
    keep_positive<P>(P::f(job.clip_at_origin_mm), dot(normal, in_camera), near, far);
  }
  // Whole numbers of steps, so that every ray samples the same distances.
  const F per_h = P::f(1.0F / job.step_mm);
  F i = P::max(P::f(0), P::ceil(near * per_h - P::f(0.5F)));
  const F end = P::floor(far * per_h - P::f(0.5F));
  M active = P::both(P::lt(P::f(0), in_camera.z), P::le(i, end));

  // From here on places are in 1/32768 voxel: a sample's cell and its place in that are bits of one whole number.
  constexpr float kUnit = 32768;
  const F step = P::f(job.step_mm * kUnit);
  const Vector<P> d{in_voxels.x * step, in_voxels.y * step, in_voxels.z * step};
  const F half = P::f(0.5F);
  const Vector<P> first{o.x * P::f(kUnit) + half * d.x, o.y * P::f(kUnit) + half * d.y, o.z * P::f(kUnit) + half * d.z};
  const F inverse[3] = {reciprocal<P>(d.x), reciprocal<P>(d.y), reciprocal<P>(d.z)};

  const F longest = P::max(P::abs(d.x), P::max(P::abs(d.y), P::abs(d.z)));
  const float runs_per_brick =
      static_cast<float>(kBrick) * kUnit / (0.0F - P::least(P::f(0) - longest)) / static_cast<float>(kRun);

  F red = P::f(0), green = P::f(0), blue = P::f(0), through = P::f(1);
  const I row = P::i(static_cast<int>(grid.row)), slice = P::i(static_cast<int>(grid.slice));
  const I brick_row = P::i(grid.bricks[0]), brick_slice = P::i(grid.bricks[0] * grid.bricks[1]);
  const auto place = [&](F index) {
    return Vector<P>{first.x + index * d.x, first.y + index * d.y, first.z + index * d.z};
  };
  while (P::any(active)) {
    float depth = 0;  // bricks that are seen all around every ray
    // Leap from empty brick to the end of all that is empty around it, until every ray is where something is seen.
    for (;;) {
      const Vector<P> x = place(i);
      constexpr int kBrickBits = 15 + 2;
      const I bx = P::min(P::template shift_right<kBrickBits>(P::truncate(x.x)), P::i(grid.bricks[0] - 1));
      const I by = P::min(P::template shift_right<kBrickBits>(P::truncate(x.y)), P::i(grid.bricks[1] - 1));
      const I bz = P::min(P::template shift_right<kBrickBits>(P::truncate(x.z)), P::i(grid.bricks[2] - 1));
      const I brick = P::add(bx, P::add(P::multiply(by, brick_row), P::multiply(bz, brick_slice)));
      const F distance = P::to_float(P::gather_byte(grid.distance, brick, active));
      const M leaps = P::both(active, P::lt(distance, P::f(kSeenBrick)));
      if (!P::any(leaps)) {
        depth = P::least(P::select(active, distance, P::f(255))) - kSeenBrick;
        break;
      }
      const F empty = distance;
      const auto exit = [&](I b, F xa, F da, F inverse_d) {
        const F low = P::to_float(b);
        const F face = P::select(P::lt(P::f(0), da), low + empty, low - empty + P::f(1)) *
                       P::f(static_cast<float>(kBrick) * kUnit);
        return (face - xa) * inverse_d;
      };
      const F steps = P::min(exit(bx, x.x, d.x, inverse[0]),
                             P::min(exit(by, x.y, d.y, inverse[1]), exit(bz, x.z, d.z, inverse[2])));
      // To the first sample past the face; one that lies on it belongs to the brick beyond.
      const F whole = P::floor(P::max(P::f(0), steps) * P::f(1 - 1e-5F)) + P::f(1);
      i = P::select(leaps, i + whole, i);
      active = P::both(active, P::le(i, end));
      if (!P::any(active)) break;
    }
    if (!P::any(active)) break;
    // As far as nothing but what is seen lies around, no ray need look at the bricks again.
    const int runs = 1 + static_cast<int>(depth * runs_per_brick);
    for (int run = 0; run < runs && P::any(active); ++run) {
      for (int sample = 0; sample < kRun; ++sample) {
        const M now = P::both(active, P::le(i, end));
        const Vector<P> at_sample = place(i);
        i = i + P::f(1);
        const I x = P::truncate(at_sample.x), y = P::truncate(at_sample.y), z = P::truncate(at_sample.z);
        const I index =
            P::add(P::template shift_right<15>(x), P::add(P::multiply(P::template shift_right<15>(y), row),
                                                          P::multiply(P::template shift_right<15>(z), slice)));
        const I within = P::i(32767);
        I entry;
        F shade, highlight;
        P::sample(grid, index, P::intersect(x, within), P::intersect(y, within), P::intersect(z, within), now, entry,
                  shade, highlight);
        I opacity_bits, colour;
        P::gather_pair(job.transfer, entry, now, opacity_bits, colour);
        const F opacity = P::as_float(opacity_bits);  // 0 where the ray is not here
        // Shades are of 1023: so are the colours that they are multiplied with.
        const I bits = P::i(1023);
        const F r = P::to_float(P::intersect(colour, bits));
        const F g = P::to_float(P::intersect(P::template shift_right<10>(colour), bits));
        const F b = P::to_float(P::template shift_right<20>(colour));
        const F weight = through * opacity;
        red = red + weight * P::min(r * shade + highlight, P::f(1));
        green = green + weight * P::min(g * shade + highlight, P::f(1));
        blue = blue + weight * P::min(b * shade + highlight, P::f(1));
        through = through - weight;
      }
      active = P::both(active, P::both(P::le(i, end), P::le(P::f(kOpaque), through)));
    }
  }
  const M opaque = P::lt(through, P::f(kOpaque));
  const F full = P::select(opaque, P::f(1) / (P::f(1) - through), P::f(1)) * P::f(255);
  const F alpha = P::select(opaque, P::f(255), (P::f(1) - through) * P::f(255));
  const auto byte = [](F value) { return P::min(P::round(value), P::i(255)); };
  const I pixels =
      P::unite(P::unite(byte(red * full), P::template shift_left<8>(byte(green * full))),
               P::unite(P::template shift_left<16>(byte(blue * full)), P::template shift_left<24>(byte(alpha))));
  alignas(64) std::uint32_t out[P::kLanes];
  P::store(out, pixels);
  const int x0 = block % job.blocks_per_row * 4;
  const int y0 = block / job.blocks_per_row * 4;
  for (int lane = 0; lane < P::kLanes; ++lane) {
    const int x = x0 + (part + lane) % 4;
    const int y = y0 + (part + lane) / 4;
    if (x >= job.width_px || y >= job.height_px) continue;
    std::uint8_t* const pixel = job.rgba + 4 * (static_cast<std::int64_t>(y) * job.width_px + x);
    __builtin_memcpy(pixel, &out[lane], 4);
  }
}

template <typename P>
void cast(const CastJob& job, int first_block, int last_block) {
  static_assert(16 % P::kLanes == 0);
  for (int block = first_block; block < last_block; ++block) {
    for (int part = 0; part < 16; part += P::kLanes) cast_packet<P>(job, block, part);
  }
}

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

/// A place along one axis of a field: the point before it and how far past that it is.
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
  P::store_first(row + x, P::min(P::max(entry, P::i(0)), P::i(kHighestHu - kLowestHu)), x_end - x);
}

/// Where the field's axes are the volume's, all of a row of voxels lies between the same four rows of the field: they
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
        const int hu = static_cast<int>(row[i] & 0xFFFF) + kLowestHu;
        low[i] = hu < low[i] ? hu : low[i];
        high[i] = hu > high[i] ? hu : high[i];
      }
    }
  }
}

template <typename P>
constexpr Kernels make_kernels() {
  return {cast<P>, light<P>, warp<P>, bounds<P>};
}

}  // namespace birdseye::host::cpu
