#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/system/background.hpp"
#include "host/guide/guided_calibration.hpp"
#include "host/guide/hand_eye_guide.hpp"

namespace birdseye::host {

/// Runs guided hand-eye calibrations, one at a time, on a thread of its own, which looks at frames and solves while the
/// window goes on. None of its calls waits for the solver.
class GuideWorker {
 public:
  /// What is guided already is given up.
  void start(GuidePlan plan);
  /// Nothing comes of what is guided: the thread is asked to stop, and what it still solves is thrown away.
  void give_up();
  [[nodiscard]] bool guiding() const { return session_ != nullptr; }

  // Of what is guided; of nothing else do they do or tell anything.
  /// Hands over an event. Bounded: where the thread falls behind, the oldest frames are left out.
  void push(const wire::Event& event);
  /// Ends the calibration with the stations that it has.
  void end(const std::string& why);
  [[nodiscard]] std::optional<GuideState> state() const;
  /// The lasting lines so far, the newest last; at most some dozens.
  [[nodiscard]] std::vector<std::string> lines() const;
  /// The outcome, once the calibration has ended; an error where something could not be used. Nothing is guided then.
  std::optional<Result<GuidedCalibration>> take();

 private:
  /// What the thread and its owner share.
  class Session;

  std::shared_ptr<Session> session_;  ///< null: nothing is guided
  Background<Result<GuidedCalibration>> work_;
};

}  // namespace birdseye::host
