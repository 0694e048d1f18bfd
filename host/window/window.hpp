#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "calibration/base/result.hpp"
#include "calibration/time/clock.hpp"
#include "host/render/gl/gl_context.hpp"
#include "host/render/scene/scene.hpp"

struct GLFWwindow;

namespace birdseye::host {

/// What the user did in a window.
struct WindowInput {
  double dragged_x_px = 0, dragged_y_px = 0;  ///< with the left button held, in pixels of the picture
  double wheel = 0;                           ///< notches away from the user
  std::string keys;                           ///< letters that were pressed, as capitals
};

/// A window that shows pictures of one size, and whose OpenGL context engines may draw with. One at a time, on the main
/// thread.
class Window final : public GlContext {
 public:
  /// Errc::unsupported names what is missing.
  static Result<std::unique_ptr<Window>> open(const std::string& title, int width_px, int height_px);
  ~Window() override;
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// rgb: rows from the top, of the size it was opened with. As large as fits into the window, its shape kept.
  void show(std::span<const std::uint8_t> rgb);
  /// What the window holds of that picture, read back from it: while it has the size it was opened with, the same.
  [[nodiscard]] ImageRgba read_back() const;
  /// What was done since the last call; waits up to `most` for something, and draws again what was laid bare.
  WindowInput wait(Duration most);
  /// The user has closed it, or pressed Esc.
  [[nodiscard]] bool closed() const;

 private:
  struct Frame {
    int x_px, y_px, width_px, height_px;
  };
  Window() = default;
  [[nodiscard]] Frame frame() const;
  void draw() const;

  GLFWwindow* window_ = nullptr;
  int width_px_ = 0, height_px_ = 0;  ///< of the pictures
  std::uint32_t picture_ = 0, framebuffer_ = 0;
  WindowInput input_;
  double mouse_x_ = 0, mouse_y_ = 0;
  bool laid_bare_ = false;
};

}  // namespace birdseye::host
