#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/record/calibration_record.hpp"
#include "host/guide/guide_worker.hpp"
#include "host/operation/findings.hpp"
#include "host/operation/live_step.hpp"

namespace birdseye::host {

/// The scope's calibration: by the board, on a thread of the guide's own, or by a record; of two the newer counts. But
/// where the appliance had a record as the board was used, and has one of another scope now, that record counts.
class CalibrationStep {
 public:
  /// Over the board; nothing without one, or where it has begun. bird: the scope's. with: what is connected.
  void begin(const std::string& bird, const std::optional<calibration::Pattern>& board, const Instruments& with);
  /// With the stations so far.
  void end();
  /// What the appliance sends, for the guide.
  void push(const wire::Event& event);
  /// True: the guide has found a calibration, of what was connected as it began: judge() is due. It finds none where
  /// the appliance has the record of another scope by now. now: what is connected.
  bool tick(const Instruments& now);

  enum class Adopted { no, again, anew };
  /// The appliance's record. again: it is the one that is in force already.
  Adopted adopt(const calibration::CalibrationRecord& record);
  /// The appliance has no record in force, and why: one that was adopted is held back. True: that changes what is
  /// found.
  bool withdraw_record(const std::string& why);
  /// Holds back what was found by the board with other hardware, and gives it back where that has come again. True:
  /// what is found is no more what it was.
  bool judge(const ConnectedInstruments& connected);
  /// What an earlier window found by the board, unless there is a newer one. The record that it had is for the
  /// appliance to send again, and adopt() then says whether it is the same. False: another calibration is in force
  /// already, so what was found by the kept one does not hold.
  bool take_up(const CalibratedScope& kept, const std::string& line);

  /// Empty where nothing is found, or what was found is held back.
  [[nodiscard]] const std::optional<CalibratedScope>& found() const { return found_; }
  /// What was found with hardware that is not connected now. Nothing is drawn by it.
  [[nodiscard]] const std::optional<CalibratedScope>& held_back() const { return held_back_; }
  /// The calibration that registration, views and deformation were found with: found(), held_back(), or that of an
  /// earlier window whose record has not come yet.
  [[nodiscard]] const std::optional<CalibratedScope>& rests_on() const {
    return found_ ? found_ : held_back_ ? held_back_ : former_;
  }
  /// Found, or held back, and no earlier window's: this one's scope.
  [[nodiscard]] bool is_of_this_window() const { return (found_ || held_back_) && !taken_up_; }
  /// It is held back because nothing tells what is connected: a person may say that it is the same.
  [[nodiscard]] bool person_may_say() const { return held_back_ && person_may_say_; }
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
  void hold_back(const std::string& why);
  void take(CalibratedScope found, const std::string& line);

  std::optional<CalibratedScope> found_, held_back_;
  std::optional<CalibratedScope> former_;  ///< of an earlier window, by a record that has not come yet
  std::string record_scope_;               ///< the scope of the record that the appliance has; empty: it has none
  std::string record_utc_;                 ///< when the appliance's last record was made
  Instruments begun_with_;                 ///< the guide
  std::string begun_scope_;                ///< record_scope_ then
  std::string line_;                       ///< of what is held back, as it was found
  bool person_may_say_ = false, taken_up_ = false;
  StepNote note_;
  std::optional<Verdict> verdict_;
  GuideWorker guide_;
};

}  // namespace birdseye::host
