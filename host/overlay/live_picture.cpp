#include "host/overlay/live_picture.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/overlay/compositor.hpp"
#include "host/overlay/surface_cues.hpp"

namespace birdseye::host {

namespace {

/// The picture without colour and darker, so that nobody takes it for live.
std::vector<std::uint8_t> greyed(const std::vector<std::uint8_t>& rgb) {
  std::vector<std::uint8_t> out(rgb.size());
  for (std::size_t i = 0; i + 2 < rgb.size(); i += 3) {
    const int grey = (77 * rgb[i] + 150 * rgb[i + 1] + 29 * rgb[i + 2]) >> 9;  // ITU-R BT.601 luma, halved
    out[i] = out[i + 1] = out[i + 2] = static_cast<std::uint8_t>(grey);
  }
  return out;
}

}  // namespace

void LivePicture::set_setup(std::optional<Setup> setup, const OverlayGate::Calibration& calibration) {
  setup_ = std::move(setup);
  calibration_ = calibration;
  gate_ = OverlayGate(settings_.gate);  // what was believed by another calibration has nothing to fade from
  gate_.set_calibration(calibration_);
  overlaid_.clear();
  kind_ = -1;
}

void LivePicture::take(const wire::VideoFrame& frame, HostTime exposed) {
  if (frame_ && frame.info.acquired < frame_->info.acquired) {
    gate_ = OverlayGate(settings_.gate);  // another clock: the times of one gate do not go back
    gate_.set_calibration(calibration_);
  }
  frame_ = frame;
  exposed_ = exposed;
  decision_ = gate_.decide(frame.info.acquired, frame.info.pose);
  if (dirty_) ++skipped_;
  dirty_ = true;
}

void LivePicture::draw() {
  if (!dirty_) return;
  dirty_ = false;
  overlaid_.clear();
  stopped_.clear();
  camera_from_patient_.reset();
  kind_ = -1;
  if (!setup_ || engine_ == nullptr || !decision_.tracker_from_sensor || decision_.strength <= 0) return;
  if (frame_->width_px != setup_->camera.width_px || frame_->height_px != setup_->camera.height_px) return;
  camera_from_patient_ = setup_->camera_from_patient(*decision_.tracker_from_sensor);
  std::vector<std::uint8_t> in_front;
  if (surface_in_front_) in_front = surface_cues(*frame_->rgb, frame_->width_px, frame_->height_px);
  overlaid_ = composite(*frame_->rgb, engine_->render(setup_->camera, *camera_from_patient_, render_),
                        decision_.strength * opacity_, in_front);
}

ShownPicture LivePicture::at(HostTime now) {
  ShownPicture out;
  if (!frame_) {
    out.reason = "no video has come yet";
    return out;
  }
  out.any = true;
  out.width_px = frame_->width_px;
  out.height_px = frame_->height_px;
  const Duration age{now.ns - exposed_.ns}, predicted = frame_->info.pose.age;
  out.age_ms = age.seconds() * 1e3;
  out.stale = age > settings_.stopped;
  if (!setup_) {
    out.reason = without_setup_;
  } else if (engine_ == nullptr) {
    out.reason = "the CT is not ready";
  } else if (out.stale) {
    out.reason = fmt::format("the video has stopped, {:.1f} s ago", age.seconds());
  } else if (age > settings_.most_age) {
    out.reason = fmt::format("the picture is {:.0f} ms old", out.age_ms);
  } else if (predicted.ns > 0 && age + predicted > settings_.most_age) {
    out.reason = fmt::format("the newest pose is {:.0f} ms old", (age + predicted).seconds() * 1e3);
  } else if (frame_->width_px != setup_->camera.width_px || frame_->height_px != setup_->camera.height_px) {
    out.reason = fmt::format("the video is {} x {} and the camera was calibrated at {} x {}", frame_->width_px,
                             frame_->height_px, setup_->camera.width_px, setup_->camera.height_px);
  } else {
    out.reason = decision_.reason;
    out.overlaid = !overlaid_.empty();
    out.strength = out.overlaid ? decision_.strength : 0;
  }
  if (out.stale && stopped_.empty()) stopped_ = greyed(*frame_->rgb);
  const int kind = out.overlaid ? 2 : out.stale ? 1 : 0;
  if (kind != kind_) ++changes_;
  kind_ = kind;
  out.changes = changes_;
  const Duration most_age = settings_.most_age - std::max(predicted, Duration{});
  if (!out.stale) out.believe_until = exposed_ + (out.overlaid ? most_age : settings_.stopped) + settings_.late;
  out.rgb = out.overlaid ? &overlaid_ : out.stale ? &stopped_ : frame_->rgb.get();
  return out;
}

}  // namespace birdseye::host
