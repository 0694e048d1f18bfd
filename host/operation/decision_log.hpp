#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/base/verdict.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "calibration/time/pose_history.hpp"
#include "host/overlay/trust.hpp"

namespace birdseye::host {

/// What was shown of a frame, why, and by which figures.
struct LoggedDecision {
  std::uint64_t sequence = 0;  ///< of the frame
  double age_ms = 0;           ///< at the screen
  double strength = 0;         ///< of the overlay, 0 to 1
  std::uint64_t shape = 0;     ///< OperationView::shapes: which CT the overlay is of
  std::string reason;          ///< why it is not whole; empty where it is
  std::string said;            ///< over the picture
  std::optional<Grade> grade;  ///< of what was said: green, amber or red; empty: what somebody had asked for
  PoseKind pose = PoseKind::refused;
  double pose_sigma_mm = 0, pose_age_ms = 0;
  std::optional<ErrorBudget> expected;                            ///< of the target; empty: it is not known
  std::optional<Transform<Camera, Patient>> camera_from_patient;  ///< where it was drawn from; empty: no overlay
};

/// A line for each frame that was shown, in FOLDER/frames.csv. It is written as it comes: an hour of it takes no
/// memory.
class DecisionLog {
 public:
  /// folder: made if need be. A log that is there already is kept beside it, as frames-1.csv, or the next that is free.
  static Result<DecisionLog> open(const std::filesystem::path& folder);
  void add(const LoggedDecision& decision);
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  /// All written; an error where the disk was full.
  Result<void> close();

 private:
  std::filesystem::path folder_;
  std::ofstream file_;
};

/// All that a log holds. path: the file, or its folder. An error names the line.
Result<std::vector<LoggedDecision>> read_decisions(const std::filesystem::path& path);

/// Of frames, one after the other.
struct LoggedErrors {
  std::vector<double> mm, expected_mm;  ///< what was expected only of those of which it was known
};

/// What a simulated operation's overlay was off by, against the truth in truth_folder: of each overlaid frame of the
/// log, by the shape of the CT that was drawn, the distance of the tumour's centre, and what was expected of it, mm.
/// camera: the lens it was drawn with; tumour_in_patient_mm: where the CT of a shape has it.
Result<std::map<std::uint64_t, LoggedErrors>> logged_target_errors(
    const std::filesystem::path& log_folder, const std::filesystem::path& truth_folder, const CameraModel& camera,
    const std::function<Eigen::Vector3d(std::uint64_t shape)>& tumour_in_patient_mm);

/// Why the CT as it is shown at the end cannot be judged by these errors, which are of other shapes of it.
std::string why_not_judged(const std::map<std::uint64_t, LoggedErrors>& errors_by_shape);

}  // namespace birdseye::host
