#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/base/verdict.hpp"
#include "host/link/drops.hpp"

namespace birdseye::host {

/// The error of the tumour's centre in one frame, against the simulator's truth.
struct FrameError {
  double time_s = 0;  ///< since the first overlaid frame
  double target_mm = 0;
  double overlay_px = 0;
};

/// How the CT was deformed.
struct DeformingFigures {
  int views = 0;
  double took_s = 0;   ///< on one core, beside the video
  std::string words;   ///< what came of it
  bool found = false;  ///< whether the overlay shows the CT deformed
  std::optional<double>
      surface_expected_mm;               ///< the error to be expected of the surface that is seen, root mean square
  std::vector<FrameError> rigid_errors;  ///< of the CT as it was taken, in the frames that were overlaid
};

/// All that the demo measured and its report says.
struct DemoFigures {
  std::string title;
  std::vector<std::string> notes;             ///< of the reader of the CT
  std::vector<FrameError> errors;             ///< of the overlay as it was drawn at last
  double deformation_mm = 0;                  ///< how far the liver has moved since the CT, where it has moved most
  std::optional<DeformingFigures> deforming;  ///< where views were kept
  std::vector<double> fiducial_residuals_mm;
  double fre_mm = 0;
  double camera_rms_px = 0;
  double held_out_px = 0;  ///< of hand-eye, as the gate judges it
  int board_views = 0;
  double tracker_rate_hz = 0;
  int frames = 0;
  int frames_dropped = 0;
  int frames_unproven = 0;         ///< before the video had first shown that it goes with the poses
  int frames_without_overlay = 0;  ///< since then
  std::map<std::string, int>
      hidden_because;  ///< how many of frames_without_overlay for which reason, without its figures
  Drops drops;         ///< frames among frames_dropped, and other messages
  std::uint64_t board_frames_left_out = 0;  ///< for want of poses
  double position_noise_mm = 0;
  double angle_noise_deg = 0;
  double wall_s = 0;
  Verdict verdict;

  /// Of one more frame without an overlay. A reason of other figures is the same reason.
  void note_hidden(const std::string& reason);
};

/// p in [0, 1]; the nearest-rank percentile; NaN of nothing.
double percentile(std::vector<double> values, double p);

/// How far the tumour's centre may be off in 95 % of the frames.
struct TargetLimits {
  double pass_mm = 3, marginal_mm = 5;
};
inline constexpr TargetLimits kTargetLimits;

/// Writes report.json and report.html into folder; the page shows overlay.png, video.png and overlay.mp4 beside it and
/// loads nothing from a network.
Result<void> write_demo_report(const std::filesystem::path& folder, const DemoFigures& figures);

}  // namespace birdseye::host
