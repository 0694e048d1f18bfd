#pragma once

#include <string>
#include <vector>

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "calibration/hand_eye/hand_eye_refinement.hpp"

namespace birdseye::calibration {

/// A station as the solvers take it.
struct PreparedStation {
  std::size_t index = 0;  ///< in the input
  CornerStation corners;  ///< its corners are kept by HandEyeStations
  SummedStation summed;
  std::size_t corners_left_out = 0;
  double view_rms_px = 0;
};

std::vector<SummedStation> summed_of(const std::vector<PreparedStation>& stations);

/// The stations that can be used, sorted by what they hold, so that nothing depends on the order in which they came.
struct HandEyeStations {
  std::vector<PreparedStation> used;
  struct Rejected {
    std::size_t index = 0;
    std::string why;
  };
  std::vector<Rejected> rejected;
  double corner_sigma_px = 0;
  double square_mm = 0;                         ///< least distance of two corners; 0 if not known
  std::vector<PatternView> views, right_views;  ///< by index; corners point into these

  HandEyeStations() = default;
  HandEyeStations(HandEyeStations&&) = default;
  HandEyeStations& operator=(HandEyeStations&&) = default;
  HandEyeStations(const HandEyeStations&) = delete;
  HandEyeStations& operator=(const HandEyeStations&) = delete;
  ~HandEyeStations() = default;
};

/// An error where the input as a whole is unusable: see calibrate_hand_eye.
Result<void> check_stations(const HandEyeInput& input);

/// Rejects, with the reason, stations with numbers that are not finite or no rotation, pictures whose corners give no
/// pose, and repeats; finds the board's pose in each picture, and the corners' sigma by their median error unless it is
/// stated. The input, checked, must stay where it is.
HandEyeStations prepare_stations(const HandEyeInput& input);

}  // namespace birdseye::calibration
