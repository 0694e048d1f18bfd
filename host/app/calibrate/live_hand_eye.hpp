#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/solve/camera_calibration.hpp"
#include "calibration/solve/hand_eye_calibration.hpp"
#include "calibration/solve/pattern.hpp"
#include "host/app/progress.hpp"

namespace birdseye::host {

/// What the guided procedure is told.
struct LivePlan {
  std::string server = "127.0.0.1";  ///< HOST:PORT of the appliance
  std::string bird = "scope";        ///< the scope's, as the appliance names it
  calibration::Pattern pattern;
  std::optional<CameraModel> camera;  ///< a lens that is known; empty: found from the same views
  std::filesystem::path keep;         ///< a folder for the stations' pictures and poses; empty: none are kept
  std::size_t fewest_stations = 12, most_stations = 40;
  double seconds = 300;  ///< then it ends with what it has
};

/// What it came to.
struct LiveSession {
  calibration::HandEyeInput input;
  int width_px = 0, height_px = 0;
  std::optional<calibration::CameraCalibration> lens;  ///< where it was found here
  std::string lens_fault;                              ///< why none was, in words
  std::string ended;                                   ///< why, in words
};

/// Connects to the appliance, has the camera's controls held, and leads through the stations: says what is covered and
/// where to go next, takes a station whenever the scope is held still over the pattern, solves after each, and stops
/// when the verdict is pass, or at the plan's limits. Errors: no appliance, one that falls silent, a pattern that looks
/// the same upside down.
Result<LiveSession> guide_hand_eye(const LivePlan& plan, Progress& progress);

}  // namespace birdseye::host
