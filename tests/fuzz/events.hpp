#pragma once

#include "device/wire/messages.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/poses.hpp"

namespace birdseye::testing {

/// Poses are poses, a frame has one unless it is refused, and its pixels are all there or none.
inline void must_be_sound(const wire::Event& event) {
  if (const auto* birds = std::get_if<wire::Birds>(&event)) {
    for (const wire::Bird& bird : birds->birds) must(is_pose(bird.tracker_from_sensor), "a bird's pose is one");
  }
  const auto* frame = std::get_if<wire::VideoFrame>(&event);
  if (frame == nullptr) return;
  const PoseAnswer& pose = frame->info.pose;
  must(pose.tracker_from_sensor.has_value() == (pose.kind != PoseKind::refused),
       "a frame has a pose or is refused one");
  must(!pose.tracker_from_sensor || is_pose(*pose.tracker_from_sensor), "a frame's pose is one");
  if (!frame->rgb) return;
  const auto pixels = static_cast<std::size_t>(frame->width_px) * static_cast<std::size_t>(frame->height_px);
  must(frame->rgb->size() == 3 * pixels, "a frame has all of its pixels");
}

}  // namespace birdseye::testing
