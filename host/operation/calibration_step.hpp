#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/record/calibration_record.hpp"
#include "host/guide/guide_worker.hpp"
#include "host/operation/findings.hpp"
#include "host/operation/live_step.hpp"

namespace birdseye::host {

/// The scope's calibration: by the board, on a thread of the guide's own, or by a record; of two the newer counts.
class CalibrationStep {
 public:
  /// Over the board; nothing without one, or where it has begun. bird: the scope's.
  void begin(const std::string& bird, const std::optional<calibration::Pattern>& board);
  /// With the stations so far.
  void end();
  /// What the appliance sends, for the guide.
  void push(const wire::Event& event);
  /// True: the guide has found a calibration.
  bool tick();

  enum class Adopted { no, again, anew };
  /// The appliance's record. again: it is the one that is in force already.
  Adopted adopt(const calibration::CalibrationRecord& record);
  /// There is none in force, and why.
  void tell_none(const std::string& why);
  /// What an earlier window found by the board, unless there is a newer one.
  void take_up(const CalibratedScope& kept, const std::string& line);

  [[nodiscard]] const std::optional<CalibratedScope>& found() const { return found_; }
  [[nodiscard]] const StepNote& note() const { return note_; }
  [[nodiscard]] bool guiding() const { return guide_.guiding(); }
  /// The stations are taken, and the last solution is being worked out.
  [[nodiscard]] bool working_out() const {
    const auto state = guide_.state();
    return state && !state->collecting;
  }
  [[nodiscard]] std::optional<GuideState> guide() const { return guide_.state(); }
  [[nodiscard]] std::vector<std::string> guide_lines() const { return guide_.lines(); }
  [[nodiscard]] const std::optional<Verdict>& verdict() const { return verdict_; }

 private:
  bool finish(const Result<GuidedCalibration>& guided);

  std::optional<CalibratedScope> found_;
  StepNote note_;
  std::optional<Verdict> verdict_;
  GuideWorker guide_;
};

}  // namespace birdseye::host
