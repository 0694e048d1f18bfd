#include "hw-sim/operation/surgeon.hpp"

#include <algorithm>

#include "calibration/base/units.hpp"
#include "hw-sim/base/hashed.hpp"

namespace birdseye::hw_sim {

namespace {

using host::LiveStep;

constexpr double kTouch_mm = 0.3;    // how the tip is set on a marker, one sigma of each axis
constexpr double kTilt_deg = 15;     // no hand holds a pointer upright
constexpr double kTouchRests_s = 1;  // and is taken for a touch
constexpr double kCheckRests_s = 1.2;
constexpr double kPatience_s = 5;  // without an overlay, before the landmark is checked again
const Eigen::Vector3d kAside_mm(0, 0, 200);

}  // namespace

Surgeon::Surgeon(OperationTruth& truth, std::uint64_t seed) : truth_(truth), seed_(hashed_word(seed, 4)) {}

void Surgeon::stand_at(host::LiveWorkflow& workflow, double at_s) {
  workflow_ = &workflow;
  next_fiducial_ = touches_ = 0;
  at_landmark_ = false;
  bare_since_s_ = at_s;
}

Eigen::Vector3d Surgeon::drawn(double sigma) {
  const double x = hashed_normal(seed_, key_++), y = hashed_normal(seed_, key_++), z = hashed_normal(seed_, key_++);
  return sigma * Eigen::Vector3d(x, y, z);
}

void Surgeon::go_to(const Eigen::Vector3d& place_in_patient_mm, double at_s, double rest_s) {
  truth_.hand().go_to(place_in_patient_mm, at_s, drawn(kTilt_deg * kRadPerDeg));
  busy_until_s_ = truth_.hand().rests_from_s() + rest_s;
}

/// One after the other, and round again, as long as the window wants more.
void Surgeon::touch(const host::OperationView& view, double at_s) {
  if (view.touches.size() < touches_) next_fiducial_ = 0;  // they are all to be touched anew
  touches_ = view.touches.size();
  const auto& places = truth_.fiducials_mm();
  go_to(places[next_fiducial_++ % places.size()] + drawn(kTouch_mm), at_s, kTouchRests_s);
}

void Surgeon::check(double at_s, HostTime now) {
  if (!at_landmark_) {
    at_landmark_ = true;
    return go_to(truth_.target_mm(), at_s, kCheckRests_s);
  }
  workflow_->primary(now);
  ++checks_;
  at_landmark_ = false;
  bare_since_s_ = at_s;
  go_to(kAside_mm, at_s, 0);
}

void Surgeon::act(double at_s, HostTime now, bool overlay_is_whole) {
  if (overlay_is_whole) bare_since_s_ = at_s;
  if (at_s < busy_until_s_) return;
  const host::OperationView view = workflow_->view();
  if (view.asks_for_instruments) workflow_->confirm_instruments();
  if (view.asks_for_patient) workflow_->confirm_patient();
  const bool connected = view.note(LiveStep::connect).done && view.note(LiveStep::calibrate).done;
  if (!connected) return;
  if (view.step == LiveStep::connect || view.step == LiveStep::calibrate) workflow_->go_to(LiveStep::fiducials);
  if (view.step == LiveStep::fiducials) {
    at_landmark_ = false;
    return touch(view, at_s);
  }
  if (view.step == LiveStep::views || view.step == LiveStep::deform) {
    ++registrations_;
    return workflow_->go_to(LiveStep::check);
  }
  if (view.step == LiveStep::check) return check(at_s, now);
  if (at_s - bare_since_s_ > kPatience_s) {
    bare_since_s_ = at_s;
    workflow_->go_to(view.note(LiveStep::fiducials).done ? LiveStep::check : LiveStep::fiducials);
  }
}

}  // namespace birdseye::hw_sim
