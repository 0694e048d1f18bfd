#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "calibration/base/verdict.hpp"
#include "calibration/guide/guidance.hpp"

namespace birdseye::host {

/// Where a guided calibration stands, for whoever holds the scope.
struct GuideState {
  std::string next;                ///< what to do, in the present language
  calibration::Coverage coverage;  ///< of the stations, once a lens is known
  std::size_t stations = 0;
  bool collecting = true;  ///< false: enough has been taken, and the last solution is being worked out
  bool pattern_seen = false;
  std::optional<double> held_out_mm;  ///< of the solution so far
  Grade grade = Grade::fail;
};

}  // namespace birdseye::host
