#include "host/operation/view_step.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

constexpr std::size_t kMostViews = 12;
// Two views from one place tell no depth. At 100 mm from the organ 5 mm are 3 degrees. A scope that turned by more than
// half of its field of view shows another part of the organ.
constexpr double kApartMm = 5, kTurnedDeg = 30;
// A hand's motion is a line to some hundredths of a millimetre for so long, and twelve measurements of a miniBIRD lie
// within it.
constexpr Duration kAveragedHalf = Duration::from_ms(60);
// Video that is 5 ms early or late puts the camera 0.2 mm and 0.15 degrees off at these speeds. Faster, and about to
// stop or turn, a hand's motion is no line any more either.
constexpr double kFastMmPerS = 40, kFastDegPerS = 30;

bool same_place(const Transform<Camera, Patient>& a, const Transform<Camera, Patient>& b) {
  const Transform<Camera, Camera> moved = a * b.inverse();
  return moved.translation().norm() < kApartMm && rotation_log(moved.rotation()).norm() < kTurnedDeg * kRadPerDeg;
}

PoseHistory::Settings averaging() {
  PoseHistory::Settings settings;
  settings.smoothing = kAveragedHalf;
  return settings;
}

}  // namespace

ViewStep::ViewStep() : scope_(averaging()) {}

bool ViewStep::moved_fast(DeviceTime from, DeviceTime to, const Setup& setup) const {
  const PoseAnswer first = scope_.at(from), last = scope_.at(to);
  if (!first.tracker_from_sensor || !last.tracker_from_sensor) return false;
  const Transform<Camera, Camera> moved = setup.camera_from_patient(*last.tracker_from_sensor) *
                                          setup.camera_from_patient(*first.tracker_from_sensor).inverse();
  const double took_s = (to - from).seconds();
  return moved.translation().norm() > kFastMmPerS * took_s ||
         rotation_log(moved.rotation()).norm() > kFastDegPerS * kRadPerDeg * took_s;
}

std::string ViewStep::why_refused(const std::optional<wire::VideoFrame>& frame,
                                  const std::optional<Transform<Camera, Patient>>& camera_from_patient,
                                  const std::optional<Setup>& setup) const {
  if (views_.size() >= kMostViews) return words("why_most_views", kMostViews);
  if (!frame || !camera_from_patient || !setup) return words("why_no_overlay");
  // What came after the frame is missing as yet: of what was before it the tracker's noise is averaged away.
  const DeviceTime averaged_to = frame->info.acquired - kAveragedHalf;
  if (moved_fast(averaged_to - kAveragedHalf - kAveragedHalf, averaged_to, *setup)) return words("why_moving");
  const auto there = std::find_if(views_.begin(), views_.end(), [&](const KeptView& view) {
    return same_place(view.camera_from_patient, *camera_from_patient);
  });
  return there == views_.end() ? std::string() : words("why_same_place", there - views_.begin() + 1, kApartMm);
}

void ViewStep::keep(const std::optional<wire::VideoFrame>& frame,
                    const std::optional<Transform<Camera, Patient>>& camera_from_patient,
                    const std::optional<Setup>& setup) {
  if (const std::string why = why_refused(frame, camera_from_patient, setup); !why.empty()) {
    note_.line = words("note_not_kept", why);
    return;
  }
  views_.push_back({*frame, *camera_from_patient});
  note_ = {views_.size() >= kEnoughViews, words("note_views_kept", views_.size())};
}

void ViewStep::take(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor) {
  // A clock that went back is another one, as of an appliance that was started anew: its times must not meet the old.
  if (scope_.newest() && acquired < *scope_.newest()) scope_ = PoseHistory(averaging());
  scope_.push(acquired, Duration{}, tracker_from_sensor);
}

void ViewStep::average(const Setup& setup) {
  while (averaged_ < views_.size()) {
    KeptView& view = views_[averaged_];
    const DeviceTime exposed = view.frame.info.acquired;
    if (!scope_.newest() || *scope_.newest() < exposed + kAveragedHalf) return;
    if (moved_fast(exposed - kAveragedHalf, exposed + kAveragedHalf, setup)) {
      views_.erase(views_.begin() + static_cast<std::ptrdiff_t>(averaged_));
      note_ = {views_.size() >= kEnoughViews, words("note_not_kept", words("why_moving"))};
      continue;
    }
    ++averaged_;
    const PoseAnswer pose = scope_.at(exposed);
    if (pose.tracker_from_sensor) view.camera_from_patient = setup.camera_from_patient(*pose.tracker_from_sensor);
  }
}

void ViewStep::undo() {
  if (!views_.empty()) views_.pop_back();
  averaged_ = std::min(averaged_, views_.size());
  note_ = {views_.size() >= kEnoughViews, words("note_views_kept", views_.size())};
}

void ViewStep::forget(const std::string& why) {
  views_.clear();
  averaged_ = 0;
  note_ = {false, why};
}

ViewAdvice ViewStep::advice(const Transform<Camera, Patient>& now, const Eigen::Vector3d& middle_mm) const {
  std::vector<Transform<Camera, Patient>> kept;
  kept.reserve(views_.size());
  for (const KeptView& view : views_) kept.push_back(view.camera_from_patient);
  return advise_view(kept, now, middle_mm);
}

}  // namespace birdseye::host
