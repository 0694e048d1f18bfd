// The part of the session that matches the CT with views: a registration on a thread of its own.
#include <fmt/format.h>
#include <tbb/task_arena.h>

#include "host/files/picture.hpp"
#include "host/operation/live_session.hpp"
#include "host/registration/similarity/overlap_mask.hpp"

namespace birdseye::host {

namespace {

constexpr std::size_t kEnoughViews = 5, kFewestViews = 2, kMostViews = 12;

Result<VideoView> view_of(const KeptView& kept, const CameraModel& camera, std::size_t number) {
  VideoView view;
  view.name = fmt::format("view {}", number);
  view.camera = camera;
  view.camera_from_patient = kept.camera_from_patient;
  const wire::VideoFrame& frame = kept.frame;
  const RgbView video{*frame.rgb, frame.width_px, frame.height_px};
  view.grey = grey_of(video);
  const std::vector<std::uint8_t> nothing_left_out(view.grey.size(), 0);
  auto mask = overlap_mask(video, nothing_left_out);
  if (!mask) return Error{mask.error().code, view.name + ": " + mask.error().what};
  view.mask = *std::move(mask);
  return view;
}

}  // namespace

void LiveSession::keep_view() {
  StepNote& note = at(LiveStep::views);
  const auto& frame = picture_.frame();
  const auto& pose = picture_.camera_from_patient();
  if (views_.size() >= kMostViews) return;
  if (!frame || !pose) {
    note.line = "not kept: there is no overlay on this frame, so that where its camera was is not sure";
    return;
  }
  views_.push_back({*frame, *pose});
  note.done = views_.size() >= kEnoughViews;
  note.line = fmt::format("{} views kept", views_.size());
}

void LiveSession::undo_view() {
  if (!views_.empty()) views_.pop_back();
  at(LiveStep::views) = {views_.size() >= kEnoughViews, fmt::format("{} views kept", views_.size())};
}

std::optional<ViewAdvice> LiveSession::view_advice() const {
  const auto& now = picture_.camera_from_patient();
  if (!now || !patient_) return std::nullopt;
  std::vector<Transform<Camera, Patient>> kept;
  kept.reserve(views_.size());
  for (const KeptView& view : views_) kept.push_back(view.camera_from_patient);
  return advise_view(kept, *now, target_in_patient_mm());
}

void LiveSession::begin_deform() {
  StepNote& note = at(LiveStep::deform);
  if (deforming() || !patient_ || !transfer_ || !picture_.setup()) return;
  if (views_.size() < kFewestViews) {
    note.line = fmt::format("{} views are too few: keep {} or more, from different sides", views_.size(), kEnoughViews);
    return;
  }
  std::vector<VideoView> views;
  for (const KeptView& kept : views_) {
    auto view = view_of(kept, picture_.setup()->camera, views.size() + 1);
    if (!view) {
      note.line = view.error().what;
      return;
    }
    views.push_back(*std::move(view));
  }
  {
    const std::lock_guard lock(steps_mutex_);
    steps_.clear();
  }
  note = {false, "matching"};
  // Neither the CT nor its labels change while it runs: a new patient waits for it (load()).
  deforming_.start(
      [this, views = std::move(views), transfer = *transfer_](const std::stop_token& stop, const auto& say) {
        ViewRegistrationSettings settings;
        settings.control_points = {3, 3, 3};  // what some views of one side tell, in seconds
        settings.progress = say;
        settings.watch.cancelled = [&stop] { return stop.stop_requested(); };
        settings.watch.step = [this](const TracePoint& step) {
          const std::lock_guard lock(steps_mutex_);
          steps_.push_back(static_cast<float>(step.similarity));
        };
        const Volume* const labels = patient_->labels ? &*patient_->labels : nullptr;
        // On one core: the others have the live picture to draw.
        tbb::task_arena one(1);
        return one.execute(
            [&] { return register_views(views, patient_->ct, labels, patient_->organ, transfer, settings); });
      });
}

void LiveSession::cancel_deform() {
  deforming_.cancel();
}

DeformProgress LiveSession::deform_progress() const {
  const std::lock_guard lock(steps_mutex_);
  return {steps_, deforming_.line()};
}

/// Views are of the poses that they were kept with, and a deformation takes in what the registration was off by:
/// another setup's is no better than none.
void LiveSession::forget_deformation(const std::string& why) {
  if (deforming()) {
    forget_running_ = true;
    cancel_deform();
  }
  if (views_.empty() && !deformation_) return;
  views_.clear();
  at(LiveStep::views) = {false, why};
  at(LiveStep::deform) = {};
  if (!std::exchange(deformation_, std::nullopt)) return;
  show_deformation();
}

void LiveSession::finish_deform(Result<ViewRegistration> found) {
  if (std::exchange(forget_running_, false)) return;
  StepNote& note = at(LiveStep::deform);
  if (!found) {
    note = {false, found.error().what};
    return;
  }
  if (found->worse_than_start) {
    note = {false, "no deformation explains the views better than none: keep other views, or go on without"};
    return;
  }
  deformation_ = *std::move(found);
  note.done = true;
  note.line =
      fmt::format("similarity {:.3f} to {:.3f} nats", deformation_->similarity_before, deformation_->similarity_after);
  if (deformation_->uncertainty_mm)
    note.line += fmt::format("; the surface is known to {:.1f} mm", *deformation_->uncertainty_mm);
  show_deformation();
  keep_operation();
}

void LiveSession::undo_deform() {
  deformation_.reset();
  at(LiveStep::deform) = {false, "undone: the CT is shown as it was taken"};
  show_deformation();
  keep_operation();
}

void LiveSession::show_deformation() {
  ++shapes_;
  if (!engine_) return;
  if (deformation_) {
    engine_->deform(deformation_->field);
  } else {
    engine_->undeform();
  }
  picture_.redraw();
}

}  // namespace birdseye::host
