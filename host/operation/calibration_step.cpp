#include "host/operation/calibration_step.hpp"

#include <utility>

#include "drivers/system/clock.hpp"
#include "host/guide/guide_words.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

bool is_same(const CalibratedScope& one, const CalibratedScope& other) {
  return one.by_board == other.by_board && one.made_utc == other.made_utc &&
         one.scope.camera() == other.scope.camera() &&
         one.scope.camera_from_sensor().matrix() == other.scope.camera_from_sensor().matrix();
}

/// By what the appliance told as the board was used, and by a record of it now.
bool is_other_scope(const CalibratedScope& by_board, const std::string& now) {
  return !by_board.record_scope.empty() && !now.empty() && by_board.record_scope != now;
}

}  // namespace

void CalibrationStep::begin(const std::string& bird, const std::optional<calibration::Pattern>& board,
                            const Instruments& with) {
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
  begun_with_ = with;
  begun_scope_ = record_scope_;
  guide_.start(std::move(plan));
}

void CalibrationStep::end() {
  guide_.end(words("guide_by_hand"));
}

void CalibrationStep::push(const wire::Event& event) {
  guide_.push(event);
}

void CalibrationStep::take(CalibratedScope found, const std::string& line) {
  found_ = std::move(found);
  held_back_.reset();
  note_ = {true, line};
}

void CalibrationStep::hold_back(const std::string& why) {
  if (found_) {
    held_back_ = std::exchange(found_, std::nullopt);
    line_ = note_.line;
  }
  note_ = {false, why};
}

bool CalibrationStep::withdraw_record(const std::string& why) {
  record_scope_.clear();
  if (!found_ && !held_back_) {
    if (!why.empty()) note_.line = why;
    return false;
  }
  if (found_ ? found_->by_board : held_back_->by_board) return false;
  const bool changes = found_.has_value();
  person_may_say_ = false;
  hold_back(words("held_record", why));
  return changes;
}

bool CalibrationStep::judge(const ConnectedInstruments& connected) {
  const auto& judged = found_ ? found_ : held_back_;
  if (!judged || !judged->by_board) return false;
  const InstrumentMatch match = connected.match(judged->found_with, DependsOn::tracker_and_camera);
  const bool changes = match.holds != found_.has_value();
  person_may_say_ = match.person_may_say;
  if (!match.holds) hold_back(match.why_not);
  if (match.holds && held_back_) {
    // Told from now on by this connection, whatever nobody told before.
    held_back_->found_with = taken_over(held_back_->found_with, connected.now());
    take(*std::exchange(held_back_, std::nullopt), line_);
  }
  return changes;
}

bool CalibrationStep::tick(const Instruments& now) {
  auto guided = guide_.take();
  if (!guided) return false;
  if (!begun_scope_.empty() && !record_scope_.empty() && begun_scope_ != record_scope_) {
    note_.line = words("note_board_other_scope");
    return false;
  }
  if (!finish(*guided)) return false;
  taken_up_ = false;
  found_->found_with = begun_with_.link == now.link ? taken_over(now, begun_with_) : begun_with_;
  found_->record_scope = begun_scope_;
  found_->in_place_of_utc = record_utc_;
  return true;
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
  take(*std::move(scope), words("note_by_board", words_of(guided->verdict.grade),
                                guided->stations.input.stations.size(), guided->hand_eye.held_out_mm));
  return true;
}

CalibrationStep::Adopted CalibrationStep::adopt(const calibration::CalibrationRecord& record) {
  auto scope = ScopeSetup::of_record(record);
  if (!scope) return Adopted::no;
  record_scope_ = record.scope;
  const std::string& made_utc = record_utc_ = record.hand_eye->provenance.made_utc;
  const auto& before = rests_on();
  // The clocks of two machines may stand otherwise: what the board was used in place of is older for sure.
  const bool older = before && (made_utc <= before->made_utc || made_utc == before->in_place_of_utc);
  if (older && before->by_board && !is_other_scope(*before, record.scope)) return Adopted::no;
  CalibratedScope adopted{*std::move(scope), made_utc, false, {record.tracker, record.camera}, record.scope};
  const bool anew = before && !is_same(*before, adopted);
  take(std::move(adopted), words("note_record_of", made_utc));
  taken_up_ = false;
  former_.reset();
  return anew ? Adopted::anew : Adopted::again;
}

bool CalibrationStep::take_up(const CalibratedScope& kept, const std::string& line) {
  if (!kept.by_board) {
    const auto& now = found_ ? found_ : held_back_;
    if (!now) former_ = kept;
    return !now || is_same(*now, kept);
  }
  const bool in_place_of_it = found_ && !found_->by_board && kept.in_place_of_utc == found_->made_utc;
  if (found_ && ((kept.made_utc <= found_->made_utc && !in_place_of_it) || is_other_scope(kept, record_scope_)))
    return false;
  if (!kept.scope.figures().held_out_px || !kept.scope.figures().held_out_mm) {
    // Nothing could be drawn by it.
    if (!found_) note_.line = words("note_kept_unknown");
    return false;
  }
  guide_.give_up();
  take(kept, line);
  taken_up_ = true;
  return true;
}

}  // namespace birdseye::host
