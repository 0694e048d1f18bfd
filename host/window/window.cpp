#include "host/window/window.hpp"

#include <GLFW/glfw3.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/window/glfw_window.hpp"

namespace birdseye::host {

namespace {

Window& window_of(GLFWwindow* window) {
  return *static_cast<Window*>(glfwGetWindowUserPointer(window));
}

}  // namespace

Result<std::unique_ptr<Window>> Window::open(const std::string& title, int width_px, int height_px) {
  hush_drivers();
  std::unique_ptr<Window> made(new Window);  // from here on its end is GLFW's
  auto opened = open_glfw_window(title, width_px, height_px, ", or write a picture with --out instead of --window");
  if (!opened) return opened.error();
  made->window_ = *opened;
  glfwSwapInterval(0);  // pictures come one by one, and a hidden window must not hold us
  made->begin();
  made->width_px_ = width_px;
  made->height_px_ = height_px;
  glCreateTextures(GL_TEXTURE_2D, 1, &made->picture_);
  glTextureStorage2D(made->picture_, 1, GL_RGBA8, width_px, height_px);
  glCreateFramebuffers(1, &made->framebuffer_);
  glNamedFramebufferTexture(made->framebuffer_, GL_COLOR_ATTACHMENT0, made->picture_, 0);

  glfwSetWindowUserPointer(made->window_, made.get());
  glfwSetWindowRefreshCallback(made->window_, [](GLFWwindow* window) { window_of(window).laid_bare_ = true; });
  glfwSetScrollCallback(made->window_,
                        [](GLFWwindow* window, double /*x*/, double y) { window_of(window).input_.wheel += y; });
  glfwSetCursorPosCallback(made->window_, [](GLFWwindow* window, double x, double y) {
    Window& w = window_of(window);
    const double dx = x - std::exchange(w.mouse_x_, x);
    const double dy = y - std::exchange(w.mouse_y_, y);
    if (glfwGetMouseButton(window, GLFW_MOUSE_BUTTON_LEFT) != GLFW_PRESS) return;
    int wide = 0, high = 0;  // in the mouse's units, which need not be pixels
    glfwGetWindowSize(window, &wide, &high);
    const double scale = std::max(static_cast<double>(w.width_px_) / wide, static_cast<double>(w.height_px_) / high);
    w.input_.dragged_x_px += dx * scale;
    w.input_.dragged_y_px += dy * scale;
  });
  glfwSetKeyCallback(made->window_, [](GLFWwindow* window, int key, int /*scan*/, int action, int /*modifiers*/) {
    if (action != GLFW_PRESS) return;
    if (key == GLFW_KEY_ESCAPE) glfwSetWindowShouldClose(window, GLFW_TRUE);
    if (key >= GLFW_KEY_A && key <= GLFW_KEY_Z) window_of(window).input_.keys += static_cast<char>(key);
  });
  return made;
}

Window::~Window() {
  if (window_ != nullptr) {
    glDeleteFramebuffers(1, &framebuffer_);
    glDeleteTextures(1, &picture_);
    glfwDestroyWindow(window_);
  }
  glfwTerminate();
}

Window::Frame Window::frame() const {
  int wide = 0, high = 0;
  glfwGetFramebufferSize(window_, &wide, &high);
  const double scale = std::min(static_cast<double>(wide) / width_px_, static_cast<double>(high) / height_px_);
  const int width = static_cast<int>(std::lround(scale * width_px_));
  const int height = static_cast<int>(std::lround(scale * height_px_));
  return {(wide - width) / 2, (high - height) / 2, width, height};
}

void Window::draw() const {
  const Frame f = frame();
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glClearColor(0, 0, 0, 1);
  glClear(GL_COLOR_BUFFER_BIT);
  // Pictures have their first row on top, OpenGL its last.
  glBlitNamedFramebuffer(framebuffer_, 0, 0, 0, width_px_, height_px_, f.x_px, f.y_px + f.height_px,
                         f.x_px + f.width_px, f.y_px, GL_COLOR_BUFFER_BIT,
                         f.width_px == width_px_ ? GL_NEAREST : GL_LINEAR);
}

void Window::show(std::span<const std::uint8_t> rgb) {
  if (rgb.size() != 3 * static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(height_px_)) return;
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage2D(picture_, 0, 0, 0, width_px_, height_px_, GL_RGB, GL_UNSIGNED_BYTE, rgb.data());
  draw();
  glfwSwapBuffers(window_);
}

ImageRgba Window::read_back() const {
  draw();
  const Frame f = frame();
  ImageRgba image{f.width_px, f.height_px, {}};
  const auto row = 4 * static_cast<std::ptrdiff_t>(f.width_px);
  image.rgba.resize(static_cast<std::size_t>(row) * static_cast<std::size_t>(f.height_px));
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadBuffer(GL_BACK);
  glReadPixels(f.x_px, f.y_px, f.width_px, f.height_px, GL_RGBA, GL_UNSIGNED_BYTE, image.rgba.data());
  for (int y = 0; y < f.height_px / 2; ++y) {
    const auto top = image.rgba.begin() + y * row;
    std::swap_ranges(top, top + row, image.rgba.begin() + (f.height_px - 1 - y) * row);
  }
  return image;
}

WindowInput Window::wait(Duration most) {
  glfwWaitEventsTimeout(std::max(1e-3, most.seconds()));
  if (std::exchange(laid_bare_, false)) {
    draw();
    glfwSwapBuffers(window_);
  }
  return std::exchange(input_, {});
}

bool Window::closed() const {
  return glfwWindowShouldClose(window_) == GLFW_TRUE;
}

}  // namespace birdseye::host
