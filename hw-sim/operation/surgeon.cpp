#include "hw-sim/operation/surgeon.hpp"

#include <algorithm>

#include "calibration/base/units.hpp"
#include "host/texts/texts.hpp"
#include "hw-sim/base/hashed.hpp"
#include "hw-sim/operation/bench_path.hpp"
#include "hw-sim/operation/operation_window.hpp"

namespace birdseye::hw_sim {

namespace {

using host::LiveStep;

constexpr double kTouch_mm = 0.3;    // how the tip is set on a marker, one sigma of each axis
constexpr double kTilt_deg = 15;     // no hand holds a pointer upright
constexpr double kTouchRests_s = 1;  // and is taken for a touch
constexpr double kCheckRests_s = 1.2;
constexpr double kBetweenViews_s = 3, kViewsPatience_s = 90;
constexpr double kPatience_s = 5;  // without an overlay, before the landmark is checked again
const Eigen::Vector3d kAside_mm(0, 0, 200);

}  // namespace

Surgeon::Surgeon(OperationTruth& truth, std::uint64_t seed, SurgeonDoes does)
    : truth_(truth), does_(does), seed_(hashed_word(seed, 4)) {}

void Surgeon::stand_at(host::LiveWorkflow& workflow, double at_s) {
  workflow_ = &workflow;
  next_fiducial_ = 0;
  guided_since_s_ = at_s;
  at_landmark_ = matching_ = false;
  bare_since_s_ = views_since_s_ = at_s;
}

Eigen::Vector3d Surgeon::drawn(double sigma) {
  const double x = hashed_normal(seed_, key_++), y = hashed_normal(seed_, key_++), z = hashed_normal(seed_, key_++);
  return sigma * Eigen::Vector3d(x, y, z);
}

void Surgeon::go_to(const Eigen::Vector3d& place_in_patient_mm, double at_s, double rest_s) {
  truth_.hand().go_to(place_in_patient_mm, at_s, drawn(kTilt_deg * kRadPerDeg));
  busy_until_s_ = truth_.hand().rests_from_s() + rest_s;
}

/// One after the other, and round again, as long as the window wants more; a touch counts once the tip has left.
/// Where all are touched and do not fit, one was missed and another touched twice: takes all back.
void Surgeon::touch(const host::OperationView& view, double at_s) {
  const auto& places = truth_.fiducials_mm();
  if (view.markers_seen && !view.unconfirmed && view.touches.size() >= places.size()) {
    for (std::size_t i = 0; i < 2 * places.size() && !workflow_->view().touches.empty(); ++i) workflow_->undo();
    next_fiducial_ = 0;
  }
  go_to(places[next_fiducial_++ % places.size()] + drawn(kTouch_mm), at_s, kTouchRests_s);
}

/// The scope goes about over the board by itself; the window tells when that is enough. A surgeon who has been at all
/// of the stations ends it.
void Surgeon::calibrate(const host::OperationView& view, double at_s, HostTime now) {
  if (view.note(LiveStep::calibrate).done) return workflow_->go_to(LiveStep::fiducials);
  if (!view.primary_refused.empty()) return;
  const bool ends = view.guide && view.guide->collecting && at_s - guided_since_s_ > BenchPath::round_s();
  if (view.guiding && !ends) return;
  guided_since_s_ = at_s;
  workflow_->primary(now);
}

/// One after the other, as the scope goes about the organ.
void Surgeon::keep_view(const host::OperationView& view, double at_s, HostTime now) {
  if (does_ == SurgeonDoes::no_views || at_s - views_since_s_ > kViewsPatience_s) {
    ++registrations_;
    return workflow_->go_to(LiveStep::check);
  }
  if (!view.primary_refused.empty()) return;
  workflow_->primary(now);  // where there are enough, it goes on
  busy_until_s_ = at_s + kBetweenViews_s;
}

void Surgeon::deform(const host::OperationView& view, HostTime now) {
  if (view.deforming) return;
  const bool done = view.note(LiveStep::deform).done;
  if (does_ == SurgeonDoes::views_too && !matching_ && !done) {
    matching_ = true;
    return workflow_->primary(now);
  }
  ++registrations_;
  if (matching_ && done) ++deformations_;
  matching_ = false;
  workflow_->go_to(LiveStep::check);
}

/// Whether the pointer is at a place that the window may be shown, as it knows no others.
bool Surgeon::points_at_one(double at_s) const {
  constexpr double kAt_mm = 8;
  const Eigen::Vector3d tip_mm = truth_.hand().at(at_s).tip_in_patient_mm;
  const auto is_there = [&](const Eigen::Vector3d& place_mm) { return (place_mm - tip_mm).norm() < kAt_mm; };
  return is_there(truth_.target_mm()) || std::ranges::any_of(truth_.fiducials_mm(), is_there);
}

/// In the landmark check.
void Surgeon::press(HostTime now) {
  ++presses_;
  workflow_->primary(now);
}

/// In haste: where a landmark is asked for, the large button is pressed before anything is pointed at, which may not be
/// taken for a look. Where the landmark does not fit, the patient is registered anew.
void Surgeon::check(const host::OperationView& view, double at_s, HostTime now) {
  if (!at_landmark_) {
    if (view.unconfirmed) press(now);
    at_landmark_ = workflow_->view().step == LiveStep::check;
    if (at_landmark_) return go_to(truth_.target_mm(), at_s, kCheckRests_s);
    checks_ += points_at_one(at_s) ? 1 : 0;
    return;
  }
  const bool first = !view.fits_at_one;
  press(now);
  if (first && workflow_->view().fits_at_one) return go_to(truth_.fiducials_mm().front(), at_s, kCheckRests_s);
  at_landmark_ = false;
  if (workflow_->view().unconfirmed) {
    workflow_->go_to(LiveStep::fiducials);
  } else {
    ++checks_;
  }
  bare_since_s_ = at_s;
  go_to(kAside_mm, at_s, 0);
}

/// The window does not know how the rod of a scope that has just come is turned.
void Surgeon::read_rod_off() {
  const auto asked = [&] { return workflow_->view().has_rod && !workflow_->view().rod_angle_deg; };
  if (!truth_.rod_angle_deg() || !asked()) return;
  workflow_->turn_rod(0);  // to the angle at which it was calibrated
  if (!asked()) workflow_->turn_rod(*truth_.rod_angle_deg() - *workflow_->view().rod_angle_deg);
}

void Surgeon::act(double at_s, HostTime now, const host::ShownPicture& shown) {
  if (is_whole(shown)) bare_since_s_ = at_s;
  const bool asks_to_move =
      shown.reason == host::words("why_video_untold") || shown.reason == host::words("why_video_differs");
  if (asks_to_move && at_s >= hurries_until_s_) {
    truth_.hurry(at_s);
    hurries_until_s_ = at_s + OperationTruth::kHurry_s;
  }
  if (at_s < busy_until_s_) return;
  if (workflow_->view().asks_for_instruments) workflow_->confirm_instruments();
  if (workflow_->view().asks_for_patient) workflow_->confirm_patient();
  read_rod_off();
  const host::OperationView view = workflow_->view();
  const bool connected = view.note(LiveStep::connect).done && view.note(LiveStep::calibrate).done;
  if (truth_.at_board(at_s) && view.step == LiveStep::calibrate) return calibrate(view, at_s, now);
  if (!connected) return;
  if (truth_.at_board(at_s)) truth_.leave_board(at_s);
  if (view.step == LiveStep::connect || view.step == LiveStep::calibrate) workflow_->go_to(LiveStep::fiducials);
  if (view.step == LiveStep::fiducials) {
    at_landmark_ = matching_ = false;
    views_since_s_ = at_s;
    return touch(view, at_s);
  }
  if (view.step == LiveStep::views) return keep_view(view, at_s, now);
  if (view.step == LiveStep::deform) return deform(view, now);
  if (view.step == LiveStep::check) return check(view, at_s, now);
  if (at_s - bare_since_s_ > kPatience_s) {
    bare_since_s_ = at_s;
    workflow_->go_to(view.note(LiveStep::fiducials).done ? LiveStep::check : LiveStep::fiducials);
  }
}

}  // namespace birdseye::hw_sim
