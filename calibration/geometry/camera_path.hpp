#pragma once

#include <span>

#include "calibration/geometry/transform.hpp"

namespace birdseye {

/// A camera on its way through key poses: at t = i exactly at keys[i], i from 0 to keys.size() - 1; t is cut to that.
/// Between them the camera's centre in the patient follows a uniform Catmull-Rom spline, p the four keys around it and
/// u = t - i:
///     c = p1 + u (p2 - p0) / 2 + u^2 (p0 - 5/2 p1 + 2 p2 - p3 / 2) + u^3 (3 p1 - p0 - 3 p2 + p3) / 2
/// (At the ends the lacking neighbour is put as far beyond the end as the other neighbour is before it: two keys give a
/// straight line.) The rotation turns about one axis at a constant rate, the shorter way. keys: at least one.
Transform<Camera, Patient> camera_along(std::span<const Transform<Camera, Patient>> keys, double t);

}  // namespace birdseye
