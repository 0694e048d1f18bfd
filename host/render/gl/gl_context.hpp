#pragma once

#include <memory>
#include <string>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// An OpenGL 4.5 core context, current on the thread that made it until the context ends: one without a window, or a
/// window's (host/window/window.hpp). What draws with it does not know which.
class GlContext {
 public:
  /// Without a window, through EGL's surfaceless platform: any GPU's driver that has it, or Mesa's software renderer.
  /// Errc::unsupported names what is missing.
  static Result<std::unique_ptr<GlContext>> offscreen();
  virtual ~GlContext() = default;
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;

  [[nodiscard]] const std::string& renderer() const { return renderer_; }
  /// The first error that the driver reported since the context was made; empty for none. Tests require that there is
  /// none.
  [[nodiscard]] const std::string& fault() const { return fault_; }

 protected:
  GlContext() = default;
  /// Called before the context is made: keeps drivers from printing, for what is missing is told in one line of ours.
  static void hush_drivers();
  /// Called once the context is current: asks for its name, and listens to its errors.
  void begin();

 private:
  std::string renderer_, fault_;
};

}  // namespace birdseye::host
