#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "calibration/detect/pattern.hpp"
#include "calibration/detect/pattern_view.hpp"
#include "device/wire/messages.hpp"
#include "host/guide/live_rests.hpp"

namespace birdseye::host {

/// A stretch of rest over the pattern: one picture of it, and the tracker's pose averaged over it.
struct LiveStation {
  calibration::PatternView view;
  Transform<Tracker, Sensor> tracker_from_sensor;
  wire::VideoFrame frame;
};

/// Takes stations from an appliance's stream: each rest of the scope with the pattern in view. What waits is bounded.
class LiveStations {
 public:
  /// bird: the scope's, as the appliance names it.
  LiveStations(calibration::Pattern pattern, std::string bird)
      : pattern_(std::move(pattern)), rests_(std::move(bird)) {}

  void push(const wire::Birds& birds);
  /// Frames are looked at once the tracker's poses reach past them.
  void push(const wire::VideoFrame& frame) { rests_.push(frame); }

  /// Says that nothing more will come: a rest that still lasts is over.
  void finish();

  /// The next station that was taken; empty where there is none.
  std::optional<LiveStation> take_station();
  /// Why a rest was no station, in words; empty where nothing is to be said.
  std::string take_remark();
  /// The pattern in the newest picture, to say how to go on from there; empty where it is not seen.
  [[nodiscard]] std::optional<calibration::PatternView> look() const;
  /// Of the scope's rests.
  [[nodiscard]] const LiveRests& rests() const { return rests_; }

 private:
  void look_at_rests();

  calibration::Pattern pattern_;
  LiveRests rests_;
  std::deque<LiveStation> stations_;
  std::size_t taken_ = 0;
  std::string remark_;
};

}  // namespace birdseye::host
