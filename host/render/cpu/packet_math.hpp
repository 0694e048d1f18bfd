#pragma once

// What the inner loops share. Nothing of the standard library here: see kernels.hpp.

#include "host/render/cpu/kernels.hpp"

namespace birdseye::host::cpu {

template <typename P>
struct Vector {
  typename P::F x, y, z;
};

/// What is seen at a sample of every ray.
template <typename P>
struct Sample {
  typename P::F opacity;
  typename P::I colour;            ///< 3 x 10 bits
  typename P::F shade, highlight;  ///< of kLightUnit
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

}  // namespace birdseye::host::cpu
