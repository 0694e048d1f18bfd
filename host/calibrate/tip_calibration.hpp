#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/base/verdict.hpp"
#include "calibration/points/pivot.hpp"
#include "calibration/points/spin_axis.hpp"
#include "host/calibrate/tip_phases.hpp"
#include "host/files/pose_files.hpp"

namespace birdseye::host {

/// What was read: poses and set.poses go together.
struct TipInput {
  PoseSet set;
  std::vector<calibration::PivotPose> poses;
  std::size_t divots = 1;
  std::optional<PoseSet> spin;
  std::string source;
  /// The poses are against a tracked reference: how far the divot is from its frame's origin tells nothing.
  bool relative = false;
  bool direction_said = false;  ///< somebody said which way the poses go
  bool unit_said = false;       ///< somebody said which unit the lengths are in
  bool inverted = false;        ///< the file holds sensor_from_tracker, and each pose was inverted
};

/// What was found out; where there is no pivot the verdict says why.
struct TipFound {
  std::optional<calibration::Pivot> pivot;
  std::optional<calibration::SpinAxis> axis;
  Verdict verdict;
};

/// Keeps the poses that were in a divot. No phases: all were in one. Refuses what divots_of refuses.
Result<TipInput> tip_input_of(PoseSet set, const std::vector<Phase>& phases);

/// The tip by the pivot, and the shaft by the spin if there is one.
Result<TipFound> calibrate_tip(const TipInput& input);

}  // namespace birdseye::host
