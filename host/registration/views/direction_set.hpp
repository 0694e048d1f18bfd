#pragma once

#include <functional>
#include <vector>

namespace birdseye::host {

/// Makes value large, starting at `start`, by Powell's direction set (Computer Journal 7(2), 1964): line searches along
/// a set of directions, one round after another. After a round, the direction that brought most is replaced by the
/// direction in which the whole round went. Needs no gradient, and value may be a little rough: lines are searched by
/// parabolas that look no closer than `close`. First steps have the length `step`; step and close are in units of the
/// unknowns. Returns the best place once a round moves less than close. Passes on what value throws.
std::vector<double> climb_by_direction_set(const std::function<double(const std::vector<double>&)>& value,
                                           const std::vector<double>& start, double step, double close);

}  // namespace birdseye::host
