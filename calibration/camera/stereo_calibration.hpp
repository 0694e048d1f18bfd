#pragma once

#include "calibration/camera/camera_calibration.hpp"

namespace birdseye::calibration {

struct StereoCalibration {
  /// Each camera with all figures of its own calibration, covariance and held-out error among them; only the lens and
  /// the boards' poses are those of the joint fit.
  CameraCalibration left, right;
  Transform<RightCamera, Camera> right_from_left;
  /// Of a small turn (rad) and a shift (mm) of the right camera's frame, exp(turn) right_from_left + shift, in this
  /// order: the residuals' variance times the inverse of the normal matrix, lenses and poses eliminated.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  double baseline_mm = 0;
  double rms_px = 0;  ///< of both cameras' points in the joint fit
  /// Boards placed by the left picture alone, seen in the right one, with lenses and relation from the other pairs.
  double held_out_px = 0;
  double epipolar_rms_px = 0;          ///< distance of points of the right picture from the left ones' epipolar lines
  std::vector<std::size_t> pairs;      ///< used, by their place in the lists given
  std::vector<RejectedView> rejected;  ///< pairs that one camera alone could use, and the pair could not
};

/// Both lenses and how the cameras stand to each other, from the same boards seen at the same time: left_views[i] and
/// right_views[i] are a pair, points go together by their number, and neither picture need show all of the board.
/// Each camera is calibrated by calibrate_camera, then everything is refined together. A pair whose pictures put the
/// board at two places, because the board moved between them, is rejected by name.
/// Errors: as calibrate_camera's, with the camera named; Errc::bad_value for lists of unequal length;
/// Errc::degenerate where fewer than three pairs are left.
Result<StereoCalibration> calibrate_stereo(std::span<const PatternView> left_views,
                                           std::span<const PatternView> right_views, Eigen::Vector2i left_size_px,
                                           Eigen::Vector2i right_size_px,
                                           const CameraCalibrationSettings& settings = {});

/// Both cameras' verdicts, and the pair's: sigma of the relation and held-out error against camera_limits.
Verdict judge_stereo(const StereoCalibration& calibration);

namespace stereo_limits {
inline constexpr std::size_t kPairsPass = 8, kPairsMarginal = 4;
// A turn of 0.05 degrees moves a point at 10 cm by 0.09 mm; 0.2 degrees move it by 0.35 mm, which shows as five pixels
// do.
inline constexpr double kTurnSigmaPass_deg = 0.05, kTurnSigmaMarginal_deg = 0.2;
// Depth from the pair is wrong by the same share as the baseline.
inline constexpr double kBaselineSigmaPass = 0.01, kBaselineSigmaMarginal = 0.03;
}  // namespace stereo_limits

}  // namespace birdseye::calibration
