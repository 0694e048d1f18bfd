#include "host/operation/view_step.hpp"

#include <fmt/format.h>

namespace birdseye::host {

namespace {

constexpr std::size_t kMostViews = 12;

}  // namespace

void ViewStep::keep(const std::optional<wire::VideoFrame>& frame,
                    const std::optional<Transform<Camera, Patient>>& camera_from_patient) {
  if (views_.size() >= kMostViews) {
    note_.line = fmt::format("not kept: {} views are the most; undo the last one, or go on", kMostViews);
    return;
  }
  if (!frame || !camera_from_patient) {
    note_.line = "not kept: there is no overlay on this frame, so that where its camera was is not sure";
    return;
  }
  views_.push_back({*frame, *camera_from_patient});
  note_ = {views_.size() >= kEnoughViews, fmt::format("{} views kept", views_.size())};
}

void ViewStep::undo() {
  if (!views_.empty()) views_.pop_back();
  note_ = {views_.size() >= kEnoughViews, fmt::format("{} views kept", views_.size())};
}

void ViewStep::forget(const std::string& why) {
  views_.clear();
  note_ = {false, why};
}

ViewAdvice ViewStep::advice(const Transform<Camera, Patient>& now, const Eigen::Vector3d& middle_mm) const {
  std::vector<Transform<Camera, Patient>> kept;
  kept.reserve(views_.size());
  for (const KeptView& view : views_) kept.push_back(view.camera_from_patient);
  return advise_view(kept, now, middle_mm);
}

}  // namespace birdseye::host
