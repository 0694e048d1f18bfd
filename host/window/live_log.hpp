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
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::host {

/// A line for each frame that was shown, in FOLDER/frames.csv: its number, age at the screen, which CT its overlay is
/// of, and where that was drawn from. It is written as it comes: an hour of it takes no memory.
class LiveLog {
 public:
  /// folder: made if need be.
  static Result<LiveLog> open(const std::filesystem::path& folder);
  /// shape: OperationView::shapes; expected_mm: of the target, TargetMark::error; 0 where it is out of view.
  void add(std::uint64_t sequence, double age_ms, double strength, std::uint64_t shape, double expected_mm,
           const std::optional<Transform<Camera, Patient>>& camera_from_patient);
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  /// All written; an error where the disk was full.
  Result<void> close();

 private:
  std::filesystem::path folder_;
  std::ofstream file_;
};

/// Of frames, one after the other.
struct LoggedErrors {
  std::vector<double> mm, expected_mm;  ///< what was expected only of those that had the target in view
};

/// What a simulated operation's overlay was off by, against the truth in truth_folder: of each overlaid frame of the
/// log, by the shape of the CT that was drawn, the distance of the tumour's centre, and what was expected of it, mm.
/// camera: the lens it was drawn with; tumour_in_patient_mm: where the CT of a shape has it.
Result<std::map<std::uint64_t, LoggedErrors>> logged_target_errors(
    const std::filesystem::path& log_folder, const std::filesystem::path& truth_folder, const CameraModel& camera,
    const std::function<Eigen::Vector3d(std::uint64_t shape)>& tumour_in_patient_mm);

}  // namespace birdseye::host
