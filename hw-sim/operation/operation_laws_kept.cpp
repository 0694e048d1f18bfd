// The law that what was said to be kept is there again.
#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "host/texts/texts.hpp"
#include "hw-sim/operation/operation_laws.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr double kTakesUpWithin_s = 2;  // once the instruments are those that it was registered with
constexpr double kSaidWithin_s = 2;     // that something could not be kept
constexpr double kSame_mm = 1e-6;       // less than any change that matters

/// kept, found: double or places, in mm.
template <typename Values>
bool is_same(const std::optional<Values>& kept, const std::optional<Values>& found) {
  if (!kept || !found) return kept.has_value() == found.has_value();
  if constexpr (std::is_same_v<Values, double>)
    return std::abs(*kept - *found) < kSame_mm;
  else
    return (*kept - *found).norm() < kSame_mm;
}

bool is_same(const host::DisplacementField& kept, const host::DisplacementField& found) {
  const auto near = [](const Eigen::Vector3f& one, const Eigen::Vector3f& other) {
    return (one - other).norm() < static_cast<float>(kSame_mm);
  };
  return kept.size == found.size && std::ranges::equal(kept.displacement_mm, found.displacement_mm, near) &&
         (kept.patient_from_lattice.matrix() - found.patient_from_lattice.matrix()).norm() < kSame_mm;
}

/// Its shape, how far it may be off, of which target that is, and with what care it is to be used.
bool is_same(const std::shared_ptr<const host::DeformedOrgan>& kept,
             const std::shared_ptr<const host::DeformedOrgan>& found) {
  if (!kept || !found) return kept == found;
  const auto error_of = [](const host::DeformedOrgan& organ) -> std::optional<Eigen::Vector2d> {
    if (!organ.target) return std::nullopt;
    return Eigen::Vector2d(organ.target->rms_mm, organ.target->radius95_mm);
  };
  return kept->made_utc == found->made_utc && kept->care == found->care && is_same(kept->field, found->field) &&
         is_same(kept->seen_rms_mm, found->seen_rms_mm) && is_same(error_of(*kept), error_of(*found)) &&
         is_same(kept->target_at_rest_mm, found->target_at_rest_mm);
}

}  // namespace

void OperationLaws::opened(std::size_t checks) {
  doubts_.opened();
  accused_ = false;
  to_take_up_ = !kept_.empty();
  board_to_take_up_ = board_kept_;
  none_to_take_up_ = nothing_kept_;
  stood_still();
  checks_when_opened_ = to_take_up_ ? std::optional(checks) : std::nullopt;
}

void OperationLaws::stood_still() {
  may_calibrate_since_s_.reset();
  ready_since_s_.reset();
  unsaid_since_s_.reset();
}

void OperationLaws::judge_calibration_kept(const host::OperationView& view, double now_s) {
  using host::LiveStep;
  if (!board_to_take_up_) return;
  if (view.note(LiveStep::calibrate).done) {
    board_to_take_up_ = false;
    return;
  }
  const bool asks = view.asks_for_instruments || view.asks_for_patient;
  if (asks || !whole_picture_ || !view.note(LiveStep::connect).done) return may_calibrate_since_s_.reset();
  const double since_s = may_calibrate_since_s_.value_or(now_s);
  may_calibrate_since_s_ = since_s;
  if (now_s - since_s < kTakesUpWithin_s) return;
  board_to_take_up_ = false;
  break_law(now_s, "kept", "the window was opened again, and the scope is not calibrated any more");
}

void OperationLaws::judge_registration_kept(const host::OperationView& view, double now_s) {
  using host::LiveStep;
  if (!view.touches.empty()) none_to_take_up_ = false;
  if (none_to_take_up_ && view.note(LiveStep::fiducials).done) {
    none_to_take_up_ = false;
    break_law(now_s, "kept", "the window was opened again, and has a registration, where none was kept");
  }
  if (!to_take_up_) return;
  const bool asks = view.asks_for_instruments || view.asks_for_patient;
  // As long as it is not known whether the instruments are the same it is held back, and not lost.
  const bool ready =
      !asks && !view.registration_held_back && view.note(LiveStep::connect).done && view.note(LiveStep::calibrate).done;
  if (!ready) return ready_since_s_.reset();
  const double since_s = ready_since_s_.value_or(now_s);
  ready_since_s_ = since_s;
  if (view.note(LiveStep::fiducials).done) {
    to_take_up_ = false;
    const std::optional<Found> found = found_in(view, now_s);
    if (!view.touches.empty() || (found && is_kept(*found))) return;
    return break_law(now_s, "kept",
                     "the window was opened again, and has another registration or deformation than was kept");
  }
  if (now_s - since_s < kTakesUpWithin_s) return;
  to_take_up_ = false;
  break_law(now_s, "kept", "the window was opened again, and the patient is not registered any more");
}

std::optional<OperationLaws::Found> OperationLaws::found_in(const host::OperationView& view, double now_s) {
  // Before, the window holds what it found with the former scope.
  if (view.note(host::LiveStep::calibrate).done) scope_ = truth_.scope_in_use(now_s);
  if (!view.fre_mm) return std::nullopt;  // three touches register, though the step asks for a fourth
  return Found{*view.fre_mm, view.deformed, view.deformed_with_care, scope_};
}

bool OperationLaws::is_kept(const Found& found) const {
  return std::ranges::any_of(kept_, [&](const Found& one) {
    if (std::abs(one.fre_mm - found.fre_mm) >= kSame_mm) return false;
    // By the views of one scope the organ is not deformed for another.
    if (one.scope != found.scope) return !found.deformed;
    return one.with_care == found.with_care && is_same(one.deformed, found.deformed);
  });
}

/// By FRE alone a registration that was kept wrongly would pass for the right one.
void OperationLaws::judge_place_kept(const Transform<Tracker, Patient>& tracker_from_patient, double now_s) {
  // What was kept is the same to the bit. Of dozens of registrations two may well be alike to kSame_mm.
  constexpr double kSameFre_mm = 1e-9;
  if (!fre_mm_) return;
  const auto& matrix = tracker_from_patient.matrix();
  const auto known = std::ranges::find_if(
      places_, [this](const auto& place) { return std::abs(place.first - *fre_mm_) < kSameFre_mm; });
  if (known == places_.end()) {
    places_.emplace_back(*fre_mm_, matrix);
  } else if ((known->second - matrix).norm() >= kSame_mm) {
    break_law(now_s, "kept", "an overlay is drawn by a registration that had the patient elsewhere before");
  }
}

void OperationLaws::take_kept(const host::OperationView& view, std::uint64_t failed_syncs, bool powerless,
                              HostTime now) {
  const double now_s = at_s(now.ns);
  const bool all_kept = !view.writing && view.fault.empty() && !powerless;
  fre_mm_ = view.fre_mm;
  in_doubt_ = view.unconfirmed || view.registration_held_back;
  board_kept_ |= all_kept && begins_at_board_ && view.note(host::LiveStep::calibrate).done;
  // What a window has not taken up yet is there all the same.
  if (!to_take_up_) {
    const std::optional<Found> found = found_in(view, now_s);
    // What is being written may be what was found and taken back since somebody last looked here.
    nothing_kept_ = !found && !view.registration_held_back && (all_kept || (nothing_kept_ && !view.writing));
    // Nobody has taken back what is held back.
    if ((all_kept || !found) && !view.registration_held_back) kept_.clear();
    if (found && std::ranges::count(kept_, *found) == 0 && (all_kept || !kept_.empty())) kept_.push_back(*found);
  }
  if (std::exchange(failed_syncs_, failed_syncs) < failed_syncs && !unsaid_since_s_) unsaid_since_s_ = now_s;
  const bool said = view.fault.starts_with(host::words("note_not_kept", ""));
  const bool kept_after_all = view.fault.empty() && !view.writing;
  if (said || kept_after_all) unsaid_since_s_.reset();
  if (!unsaid_since_s_ || now_s - *unsaid_since_s_ < kSaidWithin_s) return;
  unsaid_since_s_.reset();
  break_law(now_s, "kept", "what was found could not be kept, and the window does not say so");
}

}  // namespace birdseye::hw_sim
