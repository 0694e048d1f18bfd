#include "host/operation/fiducial_step.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "host/registration/rigid/point_matching.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

constexpr std::size_t kFewestFiducials = 3;

}  // namespace

bool FiducialStep::add(const Touch& touch, std::size_t wanted, const Instruments& found_with) {
  // They stay suspected: otherwise the next thing that speaks against the new touches would drop these too, and nobody
  // could register.
  const bool only_suspected = confirmed_ && begins_anew();
  if (held_back_ || begins_anew()) {
    dropped_ = touches_.size();
    touches_.clear();
    registered_.reset();
    fit_is_due_ = held_back_ = touches_precede_suspicion_ = false;
    confirmed_ = true;
  } else if (touches_.empty()) {
    dropped_ = 0;
  }
  if (wanted != 0 && touches_.size() >= wanted && !may_add_) return false;
  if (touches_.empty()) {
    found_with_ = found_with;
    if (!only_suspected) suspected_ = false;
  }
  touches_.push_back({touch.tip_in_tracker_mm, touch.rms_mm, std::nullopt});
  return true;
}

bool FiducialStep::take_back(std::size_t which) {
  if (held_back_ || which >= touches_.size()) return false;
  touches_.erase(touches_.begin() + static_cast<std::ptrdiff_t>(which));
  return true;
}

void FiducialStep::fit(const std::optional<std::vector<Eigen::Vector3d>>& markers_in_patient_mm, std::size_t wanted,
                       const Volume* ct) {
  fit_is_due_ = held_back_ && !touches_.empty();
  if (held_back_) return;
  if (touches_.empty()) confirmed_ = true;  // there is nothing in doubt
  registered_.reset();
  fault_.clear();
  fits_poorly_ = may_add_ = false;
  doubt_.clear();
  odd_.reset();
  for (TouchedFiducial& touch : touches_) touch.residual_mm.reset();
  note_ = {false, dropped_ > 0 && !touches_.empty() ? words("note_touched_anew", touches_.size(), dropped_)
                                                    : words("note_touched", touches_.size())};
  if (!markers_in_patient_mm || touches_.size() < kFewestFiducials) return;
  std::vector<Eigen::Vector3d> places;
  places.reserve(touches_.size());
  for (const TouchedFiducial& touch : touches_) places.push_back(touch.tip_in_tracker_mm);
  const auto found = register_by_touches(*markers_in_patient_mm, places, ct);
  // A mirrored file, a wrong scale: no touch is to blame.
  fits_poorly_ = found ? found->registered.fre_mm > kGoodFit_mm : found.error().code != Errc::unsupported;
  if (found) registered_ = found->registered;
  if (fits_poorly_ && touches_.size() > kFewestFiducials) {
    odd_ = odd_touch(*markers_in_patient_mm, places,
                     registered_ ? registered_->fiducials_in_patient_mm : std::vector<Eigen::Vector3d>(), kGoodFit_mm);
  }
  if (!found) {
    fault_ = found.error().what;
    return;
  }
  for (std::size_t i = 0; i < touches_.size(); ++i) touches_[i].residual_mm = found->residuals_mm[i];
  registered_->found_with = found_with_;
  registered_->doubt = doubt_ = found->doubt;
  may_add_ = !doubt_.empty() && touches_.size() < markers_in_patient_mm->size();
  note_.line = words("note_touched_fre", touches_.size(), registered_->fre_mm);
  if (!doubt_.empty()) note_.line = words("note_doubt", note_.line, doubt_);
  note_.done = touches_.size() >= std::max(kFewestFiducials + 1, wanted);
}

bool FiducialStep::take_up(const std::optional<RegisteredPatient>& kept, const std::string& when) {
  if (registered_) return false;
  touches_.clear();
  fit_is_due_ = held_back_ = false;
  if (!kept) return true;
  registered_ = kept;
  found_with_ = kept->found_with;
  confirmed_ = false;
  fits_poorly_ = kept->fre_mm > kGoodFit_mm;
  doubt_ = kept->doubt;
  note_ = {true, words("note_taken_up_fre", when, kept->fre_mm)};
  if (!doubt_.empty()) note_.line = words("note_doubt", note_.line, doubt_);
  return true;
}

void FiducialStep::doubt() {
  if (registered_) confirmed_ = false;
  if (registered_ || touches_.empty()) return;
  touches_.clear();
  fit_is_due_ = held_back_ = false;
  note_ = {false, words("note_touch_anew")};
}

bool FiducialStep::judge(const ConnectedInstruments& connected) {
  if (!registered_ && touches_.empty()) return false;
  const InstrumentMatch match = connected.match(found_with_, DependsOn::tracker);
  person_may_say_ = match.person_may_say;
  const bool turns = match.holds == held_back_;
  const bool changes = turns || (!match.holds && note_.line != match.why_not);
  if (!match.holds) {
    if (turns) {
      line_ = note_.line;
      done_ = note_.done;
    }
    held_back_ = true;
    note_ = {false, match.why_not};
  } else if (held_back_) {
    held_back_ = false;
    found_with_ = taken_over(found_with_, connected.now());
    if (registered_) registered_->found_with = found_with_;
    note_ = {done_, line_};
  }
  return changes;
}

}  // namespace birdseye::host
