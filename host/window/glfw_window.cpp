#include "host/window/glfw_window.hpp"

#include <GLFW/glfw3.h>

namespace birdseye::host {

namespace {

/// Why GLFW's last call failed, and what to do.
Error missing(const std::string& what, const std::string& remedy) {
  const char* why = nullptr;
  glfwGetError(&why);
  return {Errc::unsupported, "window: " + what + (why != nullptr ? std::string(" (") + why + ")" : "") + "; " + remedy};
}

}  // namespace

Result<GLFWwindow*> open_glfw_window(const std::string& title, int width_px, int height_px, const std::string& rival) {
  if (glfwInit() == GLFW_FALSE)
    return missing("there is no display",
                   "set DISPLAY, or where there is no screen begin the command with xvfb-run -a" + rival);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_DEBUG_CONTEXT, GLFW_TRUE);
  glfwWindowHint(GLFW_DEPTH_BITS, 0);
  glfwWindowHint(GLFW_STENCIL_BITS, 0);
  // By these a desktop knows the window as that of packaging/birdseye.desktop, and shows its icon.
  glfwWindowHintString(GLFW_X11_CLASS_NAME, "birdseye");
  glfwWindowHintString(GLFW_X11_INSTANCE_NAME, "birdseye");
  // GLX before EGL: a driver in software shares its picture with the X server by GLX, and sends it through a socket by
  // EGL.
  GLFWwindow* window = nullptr;
  for (const int api : {GLFW_NATIVE_CONTEXT_API, GLFW_EGL_CONTEXT_API}) {
    glfwWindowHint(GLFW_CONTEXT_CREATION_API, api);
    window = glfwCreateWindow(width_px, height_px, title.c_str(), nullptr, nullptr);
    if (window != nullptr) break;
  }
  if (window == nullptr)
    return missing("the display has no OpenGL 4.5 core", "install libgl1 and libgl1-mesa-dri" + rival);
  glfwMakeContextCurrent(window);
  return window;
}

}  // namespace birdseye::host
