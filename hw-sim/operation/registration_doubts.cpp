#include "hw-sim/operation/registration_doubts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <variant>

namespace birdseye::hw_sim {

namespace {

// Each a little longer than the window's own, for it need not doubt before.
constexpr double kUnseen_s = 0.15;   // the reference, of 0.1 s
constexpr double kPaused_s = 10.1;   // video or scope, of 10 s
constexpr double kSlipSeen_s = 0.2;  // after its end; the overlay has to be gone within 150 ms
constexpr double kBefore_s = 0.3;    // so long before a slip the window must have had the reference, to compare

constexpr double kTouches_mm = 5;   // no hand sets a tip farther beside a marker
constexpr double kPointsAt_mm = 8;  // what the window takes for a landmark that fits
constexpr double kApart_mm = 20;    // the window asks for 30, of places that it knows less well
constexpr std::size_t kFewestTouches = 3;

}  // namespace

const Eigen::Vector3d& RegistrationDoubts::place_mm(std::size_t place) const {
  const auto& fiducials_mm = truth_.fiducials_mm();
  return place < fiducials_mm.size() ? fiducials_mm[place] : truth_.target_mm();
}

std::optional<std::size_t> RegistrationDoubts::place_pointed_at(double now_s) const {
  const Eigen::Vector3d tip_mm = truth_.hand().at(now_s).tip_in_patient_mm;
  for (std::size_t place = 0; place <= truth_.fiducials_mm().size(); ++place)
    if ((place_mm(place) - tip_mm).norm() < kPointsAt_mm) return place;
  return std::nullopt;
}

/// It knows nothing of what the one before saw.
void RegistrationDoubts::opened() {
  end();
  touched_.clear();
  told_of_reference_ = false;
  reference_s_.reset();
  reference_since_s_.reset();
  video_s_.reset();
  scope_s_.reset();
  drawn_ = true;  // it may take up what was drawn by
  begin("window_opened");
}

void RegistrationDoubts::begin(const char* name) {
  looked_at_.reset();
  if (doubt_ || !drawn_) return;
  drawn_ = false;
  doubt_ = {name, false};
  ++figures_[name].began;
}

void RegistrationDoubts::end() {
  doubt_.reset();
  looked_at_.reset();
}

void RegistrationDoubts::take(const wire::Event& event, double now_s) {
  if (const auto* const birds = std::get_if<wire::Birds>(&event)) follow_birds(*birds, now_s);
  if (const auto* const health = std::get_if<wire::Health>(&event); health != nullptr && !health->reference.empty())
    told_of_reference_ = true;
  if (!std::holds_alternative<wire::VideoFrame>(event)) return;
  if (!referenced() && video_s_ && now_s - *video_s_ > kPaused_s) begin("no_video");
  video_s_ = now_s;
}

void RegistrationDoubts::follow_birds(const wire::Birds& birds, double now_s) {
  const auto has = [&birds](const char* name) { return std::ranges::count(birds.birds, name, &wire::Bird::name) > 0; };
  if (referenced()) return follow_reference(static_cast<double>(birds.acquired.ns - zero_ns_) * 1e-9, has(kReference));
  if (!has("scope")) return;
  // Whoever points at the patient meanwhile sees where he lies: the scope then has longer to come.
  const bool paused = scope_s_ && now_s - *scope_s_ > kPaused_s;
  if (paused && !(at_place_s_ && *at_place_s_ > *scope_s_ - 1)) begin("no_scope");
  scope_s_ = now_s;
}

void RegistrationDoubts::follow_reference(double acquired_s, bool seen) {
  if (!told_of_reference_) return;
  if (reference_s_ && acquired_s - *reference_s_ > kUnseen_s) {
    begin("reference_unseen");
    reference_since_s_.reset();
  }
  if (!seen) return;
  reference_s_ = acquired_s;
  if (!reference_since_s_) reference_since_s_ = acquired_s;
  for (; next_slip_ < slips_.size() && slips_[next_slip_].ends_s + kSlipSeen_s < acquired_s; ++next_slip_)
    if (*reference_since_s_ < slips_[next_slip_].begins_s - kBefore_s) begin("reference_slipped");
}

void RegistrationDoubts::follow_pointer(double now_s) {
  const auto place = place_pointed_at(now_s);
  if (!place) return;
  at_place_s_ = now_s;
  const double beside_mm = (place_mm(*place) - truth_.hand().at(now_s).tip_in_patient_mm).norm();
  if (*place < truth_.fiducials_mm().size() && beside_mm < kTouches_mm) touched_.insert(*place);
}

void RegistrationDoubts::pressed(double now_s) {
  follow_pointer(now_s);
  const auto place = place_pointed_at(now_s);
  if (!doubt_ || !place) return;
  if (!looked_at_) {
    looked_at_ = place;
  } else if ((place_mm(*looked_at_) - place_mm(*place)).norm() >= kApart_mm) {
    end();
  }
}

std::string RegistrationDoubts::shown(bool overlaid, double now_s) {
  follow_pointer(now_s);
  if (doubt_ && touched_.size() >= kFewestTouches) end();
  if (doubt_) {
    if (!std::exchange(doubt_->judged, true)) ++figures_[doubt_->name].judged;
    if (!overlaid) return {};
    return fmt::format("{}, and nobody has touched the fiducials or looked at two places since", doubt_->name);
  }
  if (overlaid) {
    drawn_ = true;
    touched_.clear();
  }
  return {};
}

}  // namespace birdseye::hw_sim
