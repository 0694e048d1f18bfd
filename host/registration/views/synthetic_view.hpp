#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "host/registration/views/point_light.hpp"
#include "host/registration/views/rigid_motion.hpp"
#include "host/registration/views/tissue.hpp"

namespace birdseye::host {

/// A laparoscope's picture with a known pose, which the registration is to match.
struct VideoView {
  std::string name;
  CameraModel camera;
  Transform<Camera, Patient> camera_from_patient;
  std::vector<std::uint8_t> grey;  ///< rows from the top
  std::vector<std::uint8_t> mask;  ///< not 0 where the picture counts
};

/// The grey of pixels without tissue: darker than tissue can be.
inline constexpr double kBackground = -0.25;

/// The synthetic picture of one view, and what a change of its pixels means for the tissue. Rays are cast through the
/// depth on a grid; light is put on the grid's points (as docs/image-formation.md does), from central differences, with
/// the headlight's fall-off, and as a camera shows it (to the power of 1 / 2.2). Everything is differentiable but for
/// the sign of a surface's facing, the faces of the grid's cells and which of a ray's samples is the deepest.
///
/// A ray is stopped by the deepest place that it has met, not by how long its way through tissue was: the light that is
/// left of it goes from 1 to 0 as that depth goes through 0. So a facing surface is drawn where the depth is 0, however
/// steeply it is looked at, and of a ray that grazes the organ half is left where it touches the boundary. Extinction
/// that adds up along the way can not do both: what stops a facing ray within a millimetre stops a grazing one, whose
/// way is ten times as long, a millimetre outside.
class SyntheticView {
 public:
  /// Every `reduction`-th pixel along each axis, the mean of the pixels about it.
  SyntheticView(const VideoView& view, const Tissue& tissue, int reduction);

  /// The video's greys at the pixels that count.
  [[nodiscard]] const std::vector<std::uint8_t>& video() const { return video_; }
  /// After render(): how many pixels show tissue.
  [[nodiscard]] std::size_t tissue_pixels() const;

  /// Casts rays from camera_from_patient * patient_from_model from now on. The brightness stays as it suits the given
  /// pose.
  void look_from(const Transform<Patient, Patient>& patient_from_model);

  /// The grey of each pixel that counts, kBackground to 1. depth_mm: at the points of the tissue's grid.
  const std::vector<double>& render(const std::vector<float>& depth_mm, const Headlight& light);
  /// After render(): by_depth += d(value)/d(depth), from d(value)/d(grey). Where on_camera is given, adds to it
  /// what a motion of rays and lamp does, about the grid's origin and along its axes.
  void pull_back(const std::vector<float>& depth_mm, const std::vector<double>& by_grey, std::vector<float>& by_depth,
                 Wrench* on_camera = nullptr);

 private:
  struct Ray {
    float origin[3], direction[3];  ///< steps of the grid, and per mm
    float near_mm, far_mm;
    float radius2;  ///< from the lens's axis, of 1 at its rim
  };
  struct Sample {
    std::uint32_t base;
    float t[3];
    float shade;
    float stops;     ///< share of the light, as the ray is deeper here than it was before
    float by_depth;  ///< of the share that it and all before it stop
    bool follows;    ///< the sample a step before it is the one before it here too: half of the shade is that one's
  };
  struct Point {
    float depth_mm, shade;
  };
  struct Band {
    std::size_t first = 0, last = 0;  ///< rays
    std::vector<Sample> samples;
    std::vector<std::uint32_t> ends;  ///< of each ray, among samples
    std::vector<Point> adjoint;
    Wrench on_rays;
  };
  void light_points(const std::vector<float>& depth_mm, const Headlight& light);
  void find_empty_bricks(const std::vector<float>& depth_mm);
  [[nodiscard]] bool beside_tissue(int x, int y, int z) const;
  [[nodiscard]] Sample sample_at(const Ray& ray, int step, std::array<int, 3>& brick) const;
  /// To the first sample past an empty brick.
  [[nodiscard]] int steps_to_leave(const Ray& ray, int step, const std::array<int, 3>& brick) const;
  [[nodiscard]] float blend(const Sample& sample, float Point::*of) const;
  void cast(Band& band);
  void pull_back_band(Band& band, const std::vector<double>& by_grey, bool rays_too);
  void pull_back_light(const std::vector<float>& depth_mm, const std::vector<float>& by_shade,
                       std::vector<float>& by_depth, Wrench* on_lamp) const;

  const Tissue& tissue_;
  Transform<Camera, Patient> camera_from_patient_;
  Eigen::Vector3d eye_mm_ = Eigen::Vector3d::Zero();  ///< on the grid
  Eigen::Matrix3d grid_from_camera_ = Eigen::Matrix3d::Identity();
  double typical_mm_ = 100;
  Headlight light_;
  std::vector<std::uint8_t> video_;
  std::vector<Eigen::Vector3d> directions_in_camera_;  ///< of the rays, unit length
  std::vector<Ray> rays_;
  std::vector<Point> points_;
  std::vector<std::uint8_t> bricks_;
  std::array<int, 3> brick_count_{};
  std::vector<double> grey_;
  std::vector<Band> bands_;
  float step_mm_ = 1;
  float soft_mm_ = 1;  ///< to both sides of the boundary, over which a ray is stopped
};

}  // namespace birdseye::host
