#pragma once

#include <Eigen/Core>

namespace birdseye::host {

enum class Room { dark, light };

/// The window's colours for a room, in [0, 1] as the screen shows them. People who see few colours tell good, warn and
/// bad apart, and each stands out from the background (tests/host/window/theme_test.cpp); no colour is alone in saying
/// what it says: a sign or words stand beside it.
struct Theme {
  Eigen::Vector3f background, text, quiet, good, warn, bad;
};
/// light room: dark on bright, that glare leaves readable; dark room: the reverse, that dazzles nobody.
const Theme& theme_of(Room room);
/// What lies over the video has a dark ground of its own in both rooms.
inline const Theme& theme_over_video() {
  return theme_of(Room::dark);
}

/// A sign beside a colour: a tick, a triangle, a square.
inline constexpr const char* kGoodSign = "\u2713";
inline constexpr const char* kWarnSign = "\u25b2";
inline constexpr const char* kBadSign = "\u25a0";

/// Makes ImGui's own parts suit the room.
void use_theme(Room room, float scale);

}  // namespace birdseye::host
