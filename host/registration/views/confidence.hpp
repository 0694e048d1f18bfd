#pragma once

#include <functional>
#include <vector>

namespace birdseye::host {

/// The surroundings of the place where a registration stopped, as offsets from it along some coordinates. A unit of
/// each is a displacement of 1 mm, root mean square over the organ's box or the organ.
struct Summit {
  std::size_t coordinates = 0;
  /// The gradient of the maximised value with respect to the coordinates, at an offset, nats a pixel.
  std::function<std::vector<double>(const std::vector<double>&)> gradient;
  /// By how much an offset moves the points of the organ's surface: 3 numbers a point, mm.
  std::function<std::vector<float>(const std::vector<double>&)> surface_moves;
};

/// The error of the surface that is to be expected, root mean square of all points, of all three axes together:
/// Laplace's approximation, from the inverse of the value's curvature, counting only pixels that err independently.
/// These are few, for what a model of the views gets wrong, it gets wrong alike over wide areas. Along directions of
/// which the views say nothing, as when an organ's surface slides along itself, the prior alone bounds the error.
/// Computes one gradient per coordinate.
double expected_error_mm(const Summit& summit);

}  // namespace birdseye::host
