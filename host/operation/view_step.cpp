#include "host/operation/view_step.hpp"

#include <fmt/format.h>

#include <algorithm>

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

std::string ViewStep::why_refused(const std::optional<Transform<Camera, Patient>>& camera_from_patient) const {
  if (views_.size() >= kMostViews) return words("why_most_views", kMostViews);
  if (!camera_from_patient) return words("why_no_overlay");
  const auto there = std::find_if(views_.begin(), views_.end(), [&](const KeptView& view) {
    return same_place(view.camera_from_patient, *camera_from_patient);
  });
  return there == views_.end() ? std::string() : words("why_same_place", there - views_.begin() + 1, kApartMm);
}

void ViewStep::keep(const std::optional<wire::VideoFrame>& frame,
                    const std::optional<Transform<Camera, Patient>>& camera_from_patient) {
  const auto seen_from = frame ? camera_from_patient : std::nullopt;
  if (const std::string why = why_refused(seen_from); !why.empty()) {
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
  for (; averaged_ < views_.size(); ++averaged_) {
    KeptView& view = views_[averaged_];
    const DeviceTime exposed = view.frame.info.acquired;
    if (!scope_.newest() || *scope_.newest() < exposed + kAveragedHalf) return;
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
