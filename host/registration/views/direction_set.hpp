#pragma once

#include <functional>
#include <vector>

namespace birdseye::host {

/// Powell's direction set (Powell, Computer Journal 7(2), 1964): line searches along a set of directions, of which the
/// one that brought most gives way to where a whole round went. The value alone is asked for, and may be a little
/// rough: lines are searched by parabolas that look no closer than `close`. Makes value large from `start`; first steps
/// are of length `step`, all units those of the unknowns. Returns the best place when a round moves less than close.
/// What value throws passes through.
std::vector<double> climb_by_direction_set(const std::function<double(const std::vector<double>&)>& value,
                                           const std::vector<double>& start, double step, double close);

}  // namespace birdseye::host
