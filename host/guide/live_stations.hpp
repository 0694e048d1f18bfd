#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/detect/pattern.hpp"
#include "calibration/detect/pattern_view.hpp"
#include "calibration/guide/still_detector.hpp"
#include "device/wire/messages.hpp"

namespace birdseye::host {

/// A stretch of rest over the pattern: one picture of it, and the tracker's pose averaged over it.
struct LiveStation {
  calibration::PatternView view;
  Transform<Tracker, Sensor> tracker_from_sensor;
  wire::VideoFrame frame;
};

/// Takes stations from an appliance's stream. Each time the scope is held still with the pattern in view, a station is
/// taken after half a second, or when the scope moves on after at least a fifth of a second. What waits is bounded.
class LiveStations {
 public:
  /// bird: the scope's, as the appliance names it.
  LiveStations(calibration::Pattern pattern, std::string bird) : pattern_(std::move(pattern)), bird_(std::move(bird)) {}

  void push(const wire::Birds& birds);
  /// Frames are looked at once the tracker's poses reach past them.
  void push(const wire::VideoFrame& frame);

  /// Says that nothing more will come: a rest that still lasts is over.
  void finish() { finish_rest(); }

  /// The next station that was taken; empty where there is none.
  std::optional<LiveStation> take_station();
  /// Why a rest was no station, in words; empty where nothing is to be said.
  std::string take_remark();
  /// The pattern in the newest picture, to say how to go on from there; empty where it is not seen.
  [[nodiscard]] std::optional<calibration::PatternView> look() const;
  /// Frames that waited for the tracker's poses until there was no more room.
  [[nodiscard]] std::uint64_t frames_left_out() const { return left_out_; }
  /// The same in words; empty where there are none.
  [[nodiscard]] std::string left_out_words() const;
  /// Whether the scope is at rest and it is not yet decided if the rest becomes a station.
  [[nodiscard]] bool deciding() const { return rest_ && !rest_->done; }

 private:
  struct Rest {
    DeviceTime first, last;
    std::vector<wire::VideoFrame> frames;  ///< at most kMostKept, spread evenly over the rest
    std::size_t seen = 0, stride = 1;
    bool done = false;
  };
  void consider(const wire::VideoFrame& frame);
  void keep(const wire::VideoFrame& frame);
  void finish_rest();

  calibration::Pattern pattern_;
  std::string bird_;
  calibration::StillDetector still_;
  DeviceTime newest_pose_;
  std::deque<wire::VideoFrame> pending_;
  std::uint64_t left_out_ = 0;
  std::optional<wire::VideoFrame> newest_;
  std::optional<Rest> rest_;
  std::deque<LiveStation> stations_;
  std::size_t taken_ = 0;
  std::string remark_;
};

}  // namespace birdseye::host
