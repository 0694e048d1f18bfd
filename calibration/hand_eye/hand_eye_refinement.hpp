#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calibration/hand_eye/hand_eye_fit.hpp"
#include "calibration/hand_eye/view_pose.hpp"

namespace birdseye::calibration {

/// A station for the refinement: what the tracker measured, and the corners of its picture or pair of pictures.
struct CornerStation {
  TrackedChain chain;
  std::vector<SeenCorners> corners;
};

struct HandEyeRefinement {
  ChainState state;
  std::vector<Transform<Camera, Marker>> camera_from_marker;  ///< most likely, with what the tracker says
  Eigen::MatrixXd covariance;  ///< of hand-eye (6), body_from_marker (6) and, if free, the time offset
  std::vector<double> cost_trace;
};

/// The most likely hand-eye, board and, if wanted, time offset over everything measured: every corner under Huber's
/// loss (kCornerHuberSigmas), and every tracked pose under its noise. Each station has a true pose of its own, unknown,
/// which is carried as the board's pose in the camera: the corners then depend on that pose alone, and with hand-eye
/// and board it gives the sensor's true pose in the tracker. Ceres eliminates these poses by the Schur complement;
/// rotations move by local quaternions. Gauss-Newton steps finish the refinement, because their gradient is exact where
/// the cost no longer tells one answer from the next; their Schur complement gives the covariance. starts: one pose per
/// station. Empty if it does not converge.
std::optional<HandEyeRefinement> refine_hand_eye(std::span<const CornerStation> stations,
                                                 std::span<const Transform<Camera, Marker>> starts,
                                                 const ChainState& start, const TrackerNoise& noise, double sigma_px,
                                                 bool time_offset);

}  // namespace birdseye::calibration
