#pragma once

#include "host/overlay/render_scene.hpp"
#include "host/render/engine.hpp"
#include "host/window/window.hpp"

namespace birdseye::host {

/// Shows the scene in a window until the user closes it, or after so many pictures where that is not 0. The mouse turns
/// the volume about its middle and the wheel comes nearer; keys: R back to the start, C the cut, D the deformation,
/// Esc. What the window showed last.
Result<Picture> show_scene(Window& window, const RenderScene& scene, Engine& engine, int most_pictures);

}  // namespace birdseye::host
