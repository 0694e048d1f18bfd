#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/camera/camera_calibration.hpp"
#include "calibration/geometry/round_field.hpp"
#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "host/files/pose_files.hpp"

namespace birdseye::host {

/// Where the stations of a hand-eye calibration lie.
struct HandEyeFiles {
  std::string board;                                    ///< SPEC
  std::vector<std::filesystem::path> images;            ///< none: points or eye_poses
  std::filesystem::path points, right_points;           ///< folders of points found before, in place of images
  std::string size;                                     ///< of the pictures that these come from, as "1920x1080"
  double pixel_aspect = 1;                              ///< width of a pixel over its height
  std::filesystem::path camera;                         ///< empty: calibrated from the images
  std::vector<std::filesystem::path> right_images;      ///< of a stereo scope's second camera
  std::filesystem::path right_camera, right_from_left;  ///< both, or neither: calibrated from the images
  std::filesystem::path poses, board_poses, eye_poses;
  PoseReading of_sensor, of_board, of_eye;  ///< how the three are read
  std::optional<Eigen::Vector3d> at_mm;     ///< of eye_poses' world: where hand-eye is to be judged
};

/// The solver's input, and what to tell about how it was read.
struct HandEyeRecording {
  calibration::HandEyeInput input;
  std::vector<std::string> notes;
  std::vector<std::string> pictures;                   ///< names of all that were read, used or not
  std::vector<std::filesystem::path> picture_files;    ///< theirs, for the report; none of points found before
  std::optional<calibration::CameraCalibration> lens;  ///< calibrated from the same images; of a stereo scope, the left
  std::optional<RoundField> round_field;               ///< that the same images agree on; empty: they show no edge
  Verdict camera_verdict;                              ///< on that
  double stream_offset_s =
      0;  ///< offset of two streams' clocks, found from their motion; the solver's offset adds to it
  double stream_correlation = 0;  ///< 0 if there are no two streams
  /// Where in eye_poses' world the solver's Marker frame has its origin: what hand-eye is good for is judged there.
  Eigen::Vector3d judged_at_mm = Eigen::Vector3d::Zero();
  /// Where the cameras look straight away from where their axes meet: how far that is behind them.
  std::optional<double> look_away_mm;
  bool directions_said = false;  ///< somebody said of both streams of poses which way they go
};

/// Reads pictures and poses and pairs them in the order of their names, numbers in them by value. There must be as many
/// pictures as poses, counting those that cannot be used. Each right picture pairs with a left one by name. eye_poses
/// are poses of the camera in the board's frame (marker_from_camera); where they and the poses have times, they pair by
/// time. Where they are no camera's before a board, for their world's origin is not ahead of them, hand-eye is judged
/// in the middle of them instead.
Result<HandEyeRecording> read_hand_eye_stations(const HandEyeFiles& files);

}  // namespace birdseye::host
