#pragma once

#include <string>

#include "calibration/base/result.hpp"

struct GLFWwindow;

namespace birdseye::host {

/// Starts GLFW and opens a window with an OpenGL 4.5 core context, current on this thread. Errc::unsupported names what
/// is missing. glfwTerminate() is its owner's to call, also after an error. rival: what to use without a window.
Result<GLFWwindow*> open_glfw_window(const std::string& title, int width_px, int height_px, const std::string& rival);

}  // namespace birdseye::host
