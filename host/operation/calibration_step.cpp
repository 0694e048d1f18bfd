#include "host/operation/calibration_step.hpp"

#include <fmt/format.h>

#include <utility>

#include "drivers/system/clock.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

void CalibrationStep::begin(const std::string& bird, const std::optional<calibration::Pattern>& board) {
  if (guiding() || !board) return;
  GuidePlan plan;
  plan.bird = bird;
  plan.pattern = *board;
  if (const auto sound = HandEyeGuide::check(plan); !sound) {
    note_.line = sound.error().what;
    return;
  }
  verdict_.reset();
  note_ = {false, words("note_over_board")};
  guide_.start(std::move(plan));
}

void CalibrationStep::end() {
  guide_.end("ended by hand");
}

void CalibrationStep::push(const wire::Event& event) {
  guide_.push(event);
}

bool CalibrationStep::tick() {
  auto guided = guide_.take();
  return guided && finish(*guided);
}

bool CalibrationStep::finish(const Result<GuidedCalibration>& guided) {
  if (!guided) {
    note_.line = guided.error().what;
    return false;
  }
  verdict_ = guided->verdict;
  auto scope = calibrated_by_board(*guided, utc_now());
  if (!scope) {
    note_.line = scope.error().what;
    return false;
  }
  found_ = *std::move(scope);
  note_.done = true;
  note_.line = fmt::format("{}: {} stations, held-out {:.2f} mm", name_of(guided->verdict.grade),
                           guided->stations.input.stations.size(), guided->hand_eye.held_out_mm);
  return true;
}

CalibrationStep::Adopted CalibrationStep::adopt(const calibration::CalibrationRecord& record) {
  auto scope = ScopeSetup::of_record(record);
  if (!scope) return Adopted::no;
  const std::string& made_utc = record.hand_eye->provenance.made_utc;
  if (found_ && found_->by_board && made_utc <= found_->made_utc) return Adopted::no;
  const bool anew = found_ && made_utc != found_->made_utc;
  found_ = {*std::move(scope), made_utc, false};
  note_ = {true, words("note_record_of", made_utc)};
  return anew ? Adopted::anew : Adopted::again;
}

void CalibrationStep::tell_none(const std::string& why) {
  if (!why.empty()) note_.line = why;
}

void CalibrationStep::take_up(const CalibratedScope& kept, const std::string& line) {
  if (found_ && kept.made_utc <= found_->made_utc) return;
  if (!kept.scope.figures().held_out_px) {
    // As 0.1.0 kept it: nothing could be drawn by it.
    if (!found_) note_.line = words("note_kept_unknown");
    return;
  }
  guide_.give_up();
  found_ = kept;
  found_->by_board = true;
  note_ = {true, line};
}

}  // namespace birdseye::host
