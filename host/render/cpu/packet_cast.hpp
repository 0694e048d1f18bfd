#pragma once

// Casting a packet of rays. Nothing of the standard library here: see kernels.hpp.

#include "host/render/cpu/packet_math.hpp"

namespace birdseye::host::cpu {

/// A run: the samples between two looks at the bricks and at the transmittance. Their loads need not wait for one
/// another.
inline constexpr int kRun = 4;
/// Voxels that a run may go on past what is seen.
inline constexpr float kStray = 5;
/// Below this, a pixel counts as opaque.
inline constexpr float kOpaque = 1.0F / 64;

/// Narrows [near, far] to where a + s * rate >= 0.
template <typename P>
inline void keep_positive(typename P::F a, typename P::F rate, typename P::F& near, typename P::F& far) {
  const typename P::F s = (P::f(0) - a) * reciprocal<P>(rate);
  const typename P::M rises = P::lt(P::f(0), rate);
  near = P::select(rises, P::max(near, s), near);
  far = P::select(rises, far, P::min(far, s));
}

/// sum: of the shaded colours; shine: of the highlights, which are white.
template <typename P>
inline void store_pixels(const CastJob& job, int block, int part, const Vector<P>& sum, typename P::F shine,
                         typename P::F through) {
  using F = typename P::F;
  using I = typename P::I;
  const typename P::M opaque = P::lt(through, P::f(kOpaque));
  const F covered = P::f(1) - through;
  const F full = P::select(opaque, P::f(255) / covered, P::f(255));
  const F alpha = P::select(opaque, P::f(255), covered * P::f(255));
  const auto shown = [&](F colour) {
    return P::min((colour * P::f(kLightUnit / 1023) + shine * P::f(kLightUnit)) * full, alpha);
  };
  const auto byte = [](F value) { return P::min(P::round(value), P::i(255)); };
  const I pixels =
      P::unite(P::unite(byte(shown(sum.x)), P::template shift_left<8>(byte(shown(sum.y)))),
               P::unite(P::template shift_left<16>(byte(shown(sum.z))), P::template shift_left<24>(byte(alpha))));
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
void cast_packet(const CastJob& job, int block, int part) {
  using F = typename P::F;
  using I = typename P::I;
  using M = typename P::M;
  const GridView& grid = job.grid;
  const float* const rays = job.directions + std::int64_t{48} * block + part;
  const Vector<P> in_camera{P::load(rays), P::load(rays + 16), P::load(rays + 32)};
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
  const auto first_after = [&](F mm) { return P::max(P::f(0), P::ceil(mm * per_h - P::f(0.5F))); };
  const float* const range = job.ranges + std::int64_t{2} * block;
  const F entry = first_after(near);
  F i = P::max(entry, first_after(P::f(range[0])));
  const F end = P::floor(P::min(far, P::f(range[1])) * per_h - P::f(0.5F));
  M active = P::both(P::lt(P::f(0), in_camera.z), P::le(i, end));

  // From here on places are in 1/65536 voxel: a sample's cell, and its place in the cell, are bits of one whole number.
  // Places are counted from where the ray enters the volume, whatever is leapt over.
  constexpr float kUnit = 65536;
  const auto start = [&](F from, F rate, F index) {
    return P::round((from + (index + P::f(0.5F)) * P::f(job.step_mm) * rate) * P::f(kUnit));
  };
  const auto advance = [&](F rate) { return P::round(rate * P::f(job.step_mm * kUnit)); };
  const I entered = P::truncate(entry);
  const I first_x = start(o.x, in_voxels.x, entry), first_y = start(o.y, in_voxels.y, entry),
          first_z = start(o.z, in_voxels.z, entry);
  const I dx = advance(in_voxels.x), dy = advance(in_voxels.y), dz = advance(in_voxels.z);
  const Vector<P> d{P::to_float(dx), P::to_float(dy), P::to_float(dz)};
  const F inverse[3] = {reciprocal<P>(d.x), reciprocal<P>(d.y), reciprocal<P>(d.z)};

  const F longest = P::max(P::f(1), P::max(P::abs(d.x), P::max(P::abs(d.y), P::abs(d.z))));
  const float longest_step = 0.0F - P::least(P::f(0) - longest);
  // Only a brick and a voxel around what is seen hold a deformation's values: no run may stray further.
  const float run_length = static_cast<float>(kRun) * longest_step <= kStray * kUnit ? static_cast<float>(kRun) : 1.0F;
  const float runs_per_brick = static_cast<float>(kBrick) * kUnit / longest_step / run_length;

  F red = P::f(0), green = P::f(0), blue = P::f(0), shine = P::f(0), through = P::f(1);
  const I brick_row = P::i(grid.bricks[0]), brick_slice = P::i(grid.bricks[0] * grid.bricks[1]);
  constexpr int kAnew = 8192;
  const bool long_rays = P::any(P::both(active, P::lt(P::f(kAnew), end - entry)));
  const auto go_to = [&](F index, I& x, I& y, I& z) {
    const I steps = P::subtract(P::truncate(index), entered);
    if (long_rays) {
      // Rounding a step adds up to half a voxel over kUnit steps: begin anew before it does.
      const I rest = P::intersect(steps, P::i(kAnew - 1));
      const F from = entry + P::to_float(P::subtract(steps, rest));
      x = P::add(start(o.x, in_voxels.x, from), P::multiply(rest, dx));
      y = P::add(start(o.y, in_voxels.y, from), P::multiply(rest, dy));
      z = P::add(start(o.z, in_voxels.z, from), P::multiply(rest, dz));
      return;
    }
    x = P::add(first_x, P::multiply(steps, dx));
    y = P::add(first_y, P::multiply(steps, dy));
    z = P::add(first_z, P::multiply(steps, dz));
  };
  while (P::any(active)) {
    float depth = 0;  // bricks that are seen all around every ray
    // Leap from empty brick to the end of all that is empty around it, until every ray is where something is seen.
    for (;;) {
      I x, y, z;
      go_to(i, x, y, z);
      constexpr int kBrickBits = 16 + 2;
      static_assert(kBrick == 1 << 2);
      const auto brick_of = [](I place, int count) {
        return P::min(P::max(P::template shift_right<kBrickBits>(place), P::i(0)), P::i(count - 1));
      };
      const I bx = brick_of(x, grid.bricks[0]), by = brick_of(y, grid.bricks[1]), bz = brick_of(z, grid.bricks[2]);
      const I brick = P::add(bx, P::add(P::multiply(by, brick_row), P::multiply(bz, brick_slice)));
      const F distance = P::to_float(P::gather_byte(grid.distance, brick, active));
      const M leaps = P::both(active, P::lt(distance, P::f(kSeenBrick)));
      if (!P::any(leaps)) {
        depth = P::least(P::select(active, distance, P::f(255))) - kSeenBrick;
        break;
      }
      const F empty = distance;
      const auto exit = [&](I b, I from, F da, F inverse_d) {
        const F low = P::to_float(b);
        const F face = P::select(P::lt(P::f(0), da), low + empty, low - empty + P::f(1)) *
                       P::f(static_cast<float>(kBrick) * kUnit);
        return (face - P::to_float(from)) * inverse_d;
      };
      const F steps =
          P::min(exit(bx, x, d.x, inverse[0]), P::min(exit(by, y, d.y, inverse[1]), exit(bz, z, d.z, inverse[2])));
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
      I x, y, z;
      go_to(i, x, y, z);
      const F left = P::min(end - i, P::f(run_length - 1));
      // All loads of a run go before their colours are looked up, for those wait for them.
      typename P::Blended blended[kRun];
      M there[kRun];
#pragma GCC unroll 4
      for (int sample = 0; sample < kRun; ++sample) {
        there[sample] = P::both(active, P::le(P::f(static_cast<float>(sample)), left));
        blended[sample] = P::blend(grid, x, y, z, there[sample]);
        x = P::add(x, dx);
        y = P::add(y, dy);
        z = P::add(z, dz);
      }
#pragma GCC unroll 4
      for (int sample = 0; sample < kRun; ++sample) {
        const Sample<P> s = P::classify(job.transfer, blended[sample]);
        const F weight = P::select(there[sample], through * s.opacity, P::f(0));
        const F lit = weight * s.shade;
        const I bits = P::i(1023);
        red = red + lit * P::to_float(P::intersect(s.colour, bits));
        green = green + lit * P::to_float(P::intersect(P::template shift_right<10>(s.colour), bits));
        blue = blue + lit * P::to_float(P::template shift_right<20>(s.colour));
        shine = shine + weight * s.highlight;
        through = through - weight;
      }
      i = i + P::f(run_length);
      active = P::both(active, P::both(P::le(i, end), P::le(P::f(kOpaque), through)));
    }
  }
  store_pixels<P>(job, block, part, {red, green, blue}, shine, through);
}

template <typename P>
void cast(const CastJob& job, int first_block, int last_block) {
  static_assert(16 % P::kLanes == 0);
  for (int block = first_block; block < last_block; ++block) {
    for (int part = 0; part < 16; part += P::kLanes) cast_packet<P>(job, block, part);
  }
}

}  // namespace birdseye::host::cpu
