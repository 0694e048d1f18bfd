#pragma once

#include <functional>
#include <vector>

namespace birdseye::host {

/// The surroundings of the place where a registration stopped, as offsets from it along some coordinates. A unit of
/// each is a displacement of 1 mm, root mean square over the organ's box or the organ.
struct Summit {
  std::size_t coordinates = 0;
  /// Of the value that was made large, nats a pixel: by the coordinates, at an offset.
  std::function<std::vector<double>(const std::vector<double>&)> gradient;
  /// What the organ's surface is moved by at an offset: 3 numbers a point, mm.
  std::function<std::vector<float>(const std::vector<double>&)> surface_moves;
};

/// The error of the surface that is to be expected, root mean square of all points, of all three axes together:
/// Laplace's approximation, from the inverse of the value's curvature for as many pixels as are independent. These are
/// few: what a model of the views gets wrong, it gets wrong alike over wide areas. Along directions of which the views
/// say nothing, such as an organ's surface that slides along itself, the prior alone bounds the error. Asks for one
/// gradient a coordinate.
double expected_error_mm(const Summit& summit);

}  // namespace birdseye::host
