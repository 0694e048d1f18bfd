#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

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

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<wire::Event> events_;
  std::size_t frames_ = 0;
  std::string end_;
  GuideState state_;
  std::deque<std::string> lines_;
  std::optional<Result<GuidedCalibration>> result_;
  std::jthread thread_;
};

}  // namespace birdseye::host
