#pragma once

#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "drivers/system/blocking_queue.hpp"
#include "drivers/system/thread.hpp"
#include "host/guide/hand_eye_guide.hpp"

namespace birdseye::host {

/// What a guided calibration found.
struct GuidedCalibration {
  GuidedStations stations;
  calibration::HandEyeResult hand_eye;
  Verdict verdict;  ///< of hand-eye and, where it was found too, of the lens
};

/// Runs the guided hand-eye calibration on a thread of its own, which looks at frames and solves while the window goes
/// on.
class GuideWorker {
 public:
  explicit GuideWorker(GuidePlan plan);

  /// Hands over an event. Bounded: where the thread falls behind, the oldest frames are left out.
  void push(const wire::Event& event);
  /// Ends the calibration with the stations that it has.
  void end(const std::string& why);

  [[nodiscard]] GuideState state() const;
  /// The lasting lines so far, the newest last; at most some dozens.
  [[nodiscard]] std::vector<std::string> lines() const;
  /// The outcome, once the calibration has ended; an error where something could not be used.
  std::optional<Result<GuidedCalibration>> take();

 private:
  void work(const std::stop_token& stop, const GuidePlan& plan);
  [[nodiscard]] std::optional<wire::Event> next(const std::stop_token& stop);
  void tell(const std::string& line);

  enum Lane : std::size_t { kFrames, kPoses, kLanes };
  static constexpr std::size_t kMostFrames = 50, kMostPoses = 2000;

  BlockingQueue<wire::Event, kLanes> events_{{{{kMostFrames, WhenFull::drop_oldest}, {kMostPoses, WhenFull::refuse}}}};
  mutable std::mutex mutex_;  // of what follows
  std::string end_;
  GuideState state_;
  std::deque<std::string> lines_;
  std::optional<Result<GuidedCalibration>> result_;
  OwnedThread thread_;
};

}  // namespace birdseye::host
