#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "calibration/solve/board.hpp"
#include "calibration/solve/hand_eye.hpp"
#include "device/wire/messages.hpp"

namespace birdseye::host {

/// Collects the stations of a hand-eye calibration from the stream: each stretch of time for which the scope held still
/// with the whole board in view becomes one, with the tracker's poses averaged over it.
class BoardStations {
 public:
  explicit BoardStations(const calibration::BoardSpec& board) : board_(board) {}

  void push(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor);
  void push(const wire::VideoFrame& frame);
  /// The scope is at rest no longer, or nothing more will come.
  void finish();

  [[nodiscard]] const std::vector<calibration::BoardView>& views() const { return views_; }
  [[nodiscard]] const std::vector<Transform<Tracker, Sensor>>& tracker_from_sensor() const { return poses_; }
  /// The tracker's scatter at rest, per axis, over all stations; what an averaged pose is uncertain by follows from it.
  [[nodiscard]] calibration::HandEyeSettings uncertainty() const;

 private:
  struct Sample {
    DeviceTime acquired;
    Transform<Tracker, Sensor> pose;
  };
  [[nodiscard]] bool at_rest(DeviceTime time) const;

  calibration::BoardSpec board_;
  std::deque<Sample> recent_;            ///< of the last second and a half
  std::vector<wire::VideoFrame> still_;  ///< frames of the stretch in hand
  std::vector<calibration::BoardView> views_;
  std::vector<Transform<Tracker, Sensor>> poses_;
  double position_squares_ = 0, angle_squares_ = 0;
  std::size_t samples_ = 0, samples_per_station_ = 0;
};

}  // namespace birdseye::host
