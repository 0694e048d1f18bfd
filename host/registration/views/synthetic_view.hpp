#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
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

/// The lamp of a laparoscope: where it is, and how it falls off with distance.
struct Headlight {
  Eigen::Vector3d offset_in_camera_mm = Eigen::Vector3d::Zero();
  double falloff = 2;  ///< brightness goes with distance^-falloff
  double ambient = 0.02;
  double vignette = 0.4;  ///< how much darker the rim of the lens's field is than its middle; grows with radius squared
};

/// The grey of pixels without tissue: darker than tissue can be.
inline constexpr double kBackground = -0.25;

/// The synthetic picture of one view, and what a change of its pixels means for the tissue. Rays are cast through
/// occupancy on a grid; light is put on the grid's points (as docs/image-formation.md does), from central differences,
/// with the headlight's fall-off, and as a camera shows it (to the power of 1 / 2.2). Everything is differentiable but
/// for the sign of a surface's facing and the faces of the grid's cells.
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

  /// The grey of each pixel that counts, kBackground to 1.
  const std::vector<double>& render(const std::vector<float>& occupancy, const Headlight& light);
  /// After render(): by_occupancy += d(value)/d(occupancy), from d(value)/d(grey). Where on_camera is given, adds to it
  /// what a motion of rays and lamp does, about the grid's origin and along its axes.
  void pull_back(const std::vector<float>& occupancy, const std::vector<double>& by_grey,
                 std::vector<float>& by_occupancy, Wrench* on_camera = nullptr);

 private:
  struct Ray {
    float origin[3], direction[3];  ///< steps of the grid, and per mm
    float near_mm, far_mm;
    float radius2;  ///< from the lens's axis, of 1 at its rim
  };
  struct Sample {
    std::uint32_t base;
    float t[3];
    float inside, opacity, shade, through;
  };
  struct Point {
    float occupancy, shade;
  };
  struct Band {
    std::size_t first = 0, last = 0;  ///< rays
    std::vector<Sample> samples;
    std::vector<std::uint32_t> ends;  ///< of each ray, among samples
    std::vector<float> left;          ///< light that reaches the background
    std::vector<Point> adjoint;
    Wrench on_rays;
  };
  void light_points(const std::vector<float>& occupancy, const Headlight& light);
  void find_empty_bricks(const std::vector<float>& occupancy);
  [[nodiscard]] bool beside_tissue(int x, int y, int z) const;
  void cast(Band& band);
  void pull_back_band(Band& band, const std::vector<double>& by_grey, bool rays_too);
  void pull_back_light(const std::vector<float>& occupancy, const std::vector<float>& by_shade,
                       std::vector<float>& by_occupancy, Wrench* on_lamp) const;

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
};

}  // namespace birdseye::host
