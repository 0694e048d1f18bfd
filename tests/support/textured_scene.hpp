#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::testing {

/// Something round with a pattern, in a room with a pattern: for what follows places from a picture to the next. Drawn
/// by its formula: rays that meet spheres.
class TexturedScene {
 public:
  /// middle_mm: of both, in the patient's frame.
  /// field: of the scope that looks, the tangent of half its angle; it is dark around. 0: no edge is seen.
  explicit TexturedScene(const Eigen::Vector3d& middle_mm, double field = 0) : middle_mm_(middle_mm), field_(field) {}

  /// moved_mm: of the thing within, not of the room. The picture is RGB, rows from the top.
  std::vector<std::uint8_t> picture(const CameraModel& camera, const Transform<Camera, Patient>& camera_from_patient,
                                    const Eigen::Vector3d& moved_mm = Eigen::Vector3d::Zero());

  /// Half of the thing is cut away, and what lies behind it is seen.
  void halve() { halved_ = true; }

 private:
  Eigen::Vector3d middle_mm_;
  double field_;
  bool halved_ = false;
  CameraModel camera_;                 ///< that rays_ are of
  std::vector<Eigen::Vector3d> rays_;  ///< of length 1, camera frame; zero where the lens shows nothing
};

}  // namespace birdseye::testing
