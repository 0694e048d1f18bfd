#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "calibration/guide/still_detector.hpp"
#include "device/wire/messages.hpp"

namespace birdseye::host {

/// A stretch of rest: one picture of it, and the tracker's pose averaged over it.
struct LiveRest {
  wire::VideoFrame frame;
  Transform<Tracker, Sensor> tracker_from_sensor;
};

/// Takes rests from an appliance's stream. Each time the scope is held still, a rest is taken after half a second, or
/// when the scope moves on after at least a fifth of a second. What waits is bounded.
class LiveRests {
 public:
  /// bird: the scope's, as the appliance names it.
  explicit LiveRests(std::string bird);

  void push(const wire::Birds& birds);
  /// Frames are looked at once the tracker's poses reach past them.
  void push(const wire::VideoFrame& frame);

  /// Says that nothing more will come: a rest that still lasts is over.
  void finish() { finish_rest(); }

  /// The next rest that was taken; empty where there is none.
  std::optional<LiveRest> take();
  /// Why a rest was not taken, in words; empty where nothing is to be said.
  std::string take_remark();
  [[nodiscard]] const std::optional<wire::VideoFrame>& newest_frame() const { return newest_; }
  /// Frames that waited for the tracker's poses until there was no more room.
  [[nodiscard]] std::uint64_t frames_left_out() const { return left_out_; }
  /// The same in words; empty where there are none.
  [[nodiscard]] std::string left_out_words() const;
  /// Whether the scope is at rest and it is not yet decided if that counts.
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

  std::string bird_;
  calibration::StillDetector still_;  ///< remembers for longer than a busy machine lets frames wait
  DeviceTime newest_pose_;
  std::deque<wire::VideoFrame> pending_;
  std::uint64_t left_out_ = 0;
  std::optional<wire::VideoFrame> newest_;
  std::optional<Rest> rest_;
  std::deque<LiveRest> taken_;
  std::string remark_;
};

}  // namespace birdseye::host
