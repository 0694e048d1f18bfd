#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/files/pose_files.hpp"

namespace birdseye::host {

/// Poses at which the tip stood in one divot, by their index among all poses; both ends belong to the phase.
struct Phase {
  std::size_t first = 0, last = 0;
};

/// "77-162,172-253". Refuses what is no such list, ends in the wrong order and phases that overlap, naming the phase.
Result<std::vector<Phase>> parse_phases(const std::string& text);

/// In which divot each pose was, from 0; none where it was between phases. Refuses a phase without poses or beyond
/// them.
Result<std::vector<std::optional<std::size_t>>> divots_of(const std::vector<Phase>& phases, const PoseSet& set);

}  // namespace birdseye::host
