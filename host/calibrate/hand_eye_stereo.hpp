#pragma once

#include "host/calibrate/hand_eye_files.hpp"
#include "host/calibrate/picture_views.hpp"

namespace birdseye::host {

/// The second camera's pictures, and its lens where that is given: files.right_images or right_points, and what goes
/// with them.
struct RightPictures {
  std::vector<calibration::PatternView> views;  ///< [i] shows the moment of left[i]; without points: not found
  int width_px = 0, height_px = 0;
  std::optional<calibration::StereoLens> lens;  ///< none: to be calibrated from the same pictures
};

/// Reads the right pictures, which pair with the left ones by name. Notes tell in which the board is not found.
Result<RightPictures> read_right_pictures(const HandEyeFiles& files, const std::optional<calibration::Pattern>& pattern,
                                          const std::vector<calibration::PatternView>& left,
                                          std::vector<std::string>& notes);

/// Refuses a relation of the cameras that contradicts the pictures: boards placed by the left pictures are then not
/// where the right pictures show them.
Result<void> check_relation(const HandEyeFiles& files, const calibration::HandEyeInput& input);

}  // namespace birdseye::host
