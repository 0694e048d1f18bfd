#include "host/operation/calibration_step.hpp"

#include <fmt/format.h>

#include "drivers/system/clock.hpp"
#include "host/operation/operation.hpp"

namespace birdseye::host {

void CalibrationStep::begin(const std::string& bird, const std::optional<calibration::Pattern>& board) {
  if (guide_ || !board) return;
  GuidePlan plan;
  plan.bird = bird;
  plan.pattern = *board;
  if (const auto sound = HandEyeGuide::check(plan); !sound) {
    note_.line = sound.error().what;
    return;
  }
  verdict_.reset();
  note_ = {false, "hold the scope over the board"};
  guide_ = std::make_unique<GuideWorker>(plan);
}

void CalibrationStep::end() {
  if (guide_) guide_->end("ended by hand");
}

void CalibrationStep::push(const wire::Event& event) {
  if (guide_) guide_->push(event);
}

bool CalibrationStep::tick() {
  if (!guide_) return false;
  auto guided = guide_->take();
  return guided && finish(*std::move(guided));
}

bool CalibrationStep::finish(Result<GuidedCalibration> guided) {
  guide_.reset();
  if (!guided) {
    note_.line = guided.error().what;
    return false;
  }
  verdict_ = guided->verdict;
  if (guided->verdict.grade == Grade::fail) {
    note_.line = "the verdict is fail; " + (guided->verdict.reasons.empty() ? "" : guided->verdict.reasons.front());
    return false;
  }
  const GuidedStations& stations = guided->stations;
  const auto camera_rms_px = stations.lens ? std::optional(stations.lens->rms_px) : std::nullopt;
  found_ = {ScopeSetup::of_hand_eye(*stations.input.camera, camera_rms_px, guided->hand_eye), utc_now(), true};
  note_.done = true;
  note_.line = fmt::format("{}: {} stations, held-out {:.2f} mm", name_of(guided->verdict.grade),
                           stations.input.stations.size(), guided->hand_eye.held_out_mm);
  return true;
}

CalibrationStep::Adopted CalibrationStep::adopt(const calibration::CalibrationRecord& record) {
  auto scope = ScopeSetup::of_record(record);
  if (!scope) return Adopted::no;
  const std::string& made_utc = record.hand_eye->provenance.made_utc;
  if (found_ && found_->by_board && made_utc <= found_->made_utc) return Adopted::no;
  const bool anew = found_ && made_utc != found_->made_utc;
  found_ = {*std::move(scope), made_utc, false};
  note_ = {true, fmt::format("by the scope's record of {}", made_utc)};
  return anew ? Adopted::anew : Adopted::again;
}

void CalibrationStep::tell_none(const std::string& why) {
  if (!why.empty()) note_.line = why;
}

void CalibrationStep::take_up(const CalibratedScope& kept, const std::string& line) {
  if (found_ && kept.made_utc <= found_->made_utc) return;
  guide_.reset();
  found_ = kept;
  found_->by_board = true;
  note_ = {true, line};
}

std::optional<GuideState> CalibrationStep::guide() const {
  if (!guide_) return std::nullopt;
  return guide_->state();
}

std::vector<std::string> CalibrationStep::guide_lines() const {
  return guide_ ? guide_->lines() : std::vector<std::string>();
}

}  // namespace birdseye::host
