#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "calibration/hand_eye/hand_eye_fit.hpp"

namespace birdseye::calibration {

/// Stations as they came, for what is told of them in words.
struct StationsInOrder {
  std::span<const SummedStation> stations;  ///< in an order of their own
  std::vector<std::size_t> rank;            ///< of each in the order in which they were given
  double square_mm = 0;                     ///< least distance of two corners; 0 if not known
  bool given_poses = false;                 ///< the camera's poses were given too, and may be the inverted ones
  bool time_offset = false;                 ///< is not known: it may move what the tracker says
  bool sensor_inverted = false, eye_inverted = false;  ///< as HandEyeInput has them
};

/// What follows from the turns between stations alone, and from the tracker's distances against the camera's: whether
/// hand-eye is determined, along which direction it is not, whether poses and pictures belong together, which way round
/// the poses are, and how large the board is.
HandEyeObservability observe_hand_eye(const StationsInOrder& in, const std::optional<TrackerNoise>& noise);

/// Stations that hold nothing new, and why, in words; empty for the others.
std::vector<std::string> find_repeats(std::span<const SummedStation> stations, std::span<const std::string> names);

}  // namespace birdseye::calibration
