#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "host/registration/geometry/seen_point.hpp"
#include "host/registration/geometry/seen_surface.hpp"

namespace birdseye::host {

/// One point in place of neighbours of one kind: their middle, as far off the surface as they are by a mean that
/// outliers do not move, and with their shift, which must be one. Its sigma is of their spread, and no less than what
/// they have wrong together. Fewer points, each better, make a fit both faster and more exact.
std::vector<SeenPoint> gathered_points(std::span<const SeenPoint> points, const SeenSurface& surface);

/// Rows of a file, with one point in place of those that tell of one place.
struct GatheredRows {
  std::vector<SeenPoint> points;
  std::vector<std::size_t> of_row;  ///< of each row the index of its point
};

/// Rows close together that agree are told as one point, as above, for one touch that is given three hundred times is
/// no surer than once. Rows close together that contradict one another stay apart, each to be judged by itself. No
/// point has a smaller sigma than a gathered one, and all share a shift.
GatheredRows gathered_rows(std::span<const SeenPoint> rows, const SeenSurface& surface);

}  // namespace birdseye::host
