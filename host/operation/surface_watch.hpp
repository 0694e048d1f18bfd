#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "calibration/geometry/camera_model.hpp"
#include "drivers/system/background.hpp"
#include "host/operation/findings.hpp"
#include "host/operation/organ_motion.hpp"
#include "host/operation/view_step.hpp"
#include "host/registration/geometry/organ_at_rest.hpp"

namespace birdseye::host {

/// A deformation, and all that it was found by.
struct WatchedSurface {
  std::vector<KeptView> views;
  CameraModel camera;
  std::shared_ptr<const OrganAtRest> organ;
  std::shared_ptr<const DeformedOrgan> deformed;
};

/// Holds the video against the deformed surface once a second, on a thread of its own: one frame at a time, and none
/// waits. The thread makes the surface once a deformation, and has copies of all it is given.
class SurfaceWatch {
 public:
  /// Another deformation is shown.
  void show(WatchedSurface surface);
  /// None is.
  void forget() { shown_.reset(); }
  [[nodiscard]] bool watches() const { return shown_ != nullptr; }

  /// A frame, and where it was seen from; whenever one comes. pose_mm: how well that is known, each axis; empty: it is
  /// not known, and nothing can be told.
  void offer(const KeptView& frame, const std::optional<double>& pose_mm, HostTime now);
  /// What was found of the deformation that is shown.
  std::optional<CheckedSurface> tick();

 private:
  struct Shown;
  struct Outcome {
    CheckedSurface checked;
    std::shared_ptr<Shown> of;
  };

  std::shared_ptr<Shown> shown_;
  std::optional<HostTime> last_;
  Background<Outcome> checking_;
};

}  // namespace birdseye::host
