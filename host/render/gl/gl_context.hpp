#pragma once

#include <memory>
#include <string>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// An OpenGL 4.5 core context without a window, current on the thread that made it until it ends. Any GPU's driver that
/// has EGL's surfaceless platform, or Mesa's software renderer.
class GlContext {
 public:
  /// Errc::unsupported names what is missing.
  static Result<std::unique_ptr<GlContext>> offscreen();
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  [[nodiscard]] const std::string& renderer() const { return renderer_; }
  /// The first error that the driver reported since the context was made; empty for none. Tests want none.
  [[nodiscard]] const std::string& fault() const { return fault_; }

 private:
  GlContext() = default;
  void* display_ = nullptr;
  void* context_ = nullptr;
  std::string renderer_, fault_;
};

}  // namespace birdseye::host
