#pragma once

#include <memory>
#include <vector>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "host/deform/displacement_field.hpp"
#include "host/render/scene.hpp"
#include "host/render/transfer_function.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// The ray of every pixel of a camera, unit, camera frame; zero where the lens does not see. Takes a while to make, so
/// it is made once per camera.
class LensRays {
 public:
  explicit LensRays(const CameraModel& camera);
  [[nodiscard]] const CameraModel& camera() const { return camera_; }
  [[nodiscard]] const Eigen::Vector3f& at(std::size_t pixel) const { return directions_[pixel]; }

 private:
  CameraModel camera_;
  std::vector<Eigen::Vector3f> directions_;
};

/// Renders a volume by casting rays, on all cores, in single precision. Bricks of the volume that the transfer function
/// does not show are leapt over, all that lie between a sample and the nearest brick it does show at once. The picture
/// is the same to the bit for any number of threads.
class RayCaster {
 public:
  /// Keeps a reference to volume, which must outlive it.
  RayCaster(const Volume& volume, const TransferFunction& transfer);

  /// deformation: null for the volume as it was scanned.
  [[nodiscard]] ImageRgba render(const LensRays& rays, const Transform<Camera, Patient>& camera_from_patient,
                                 const RenderSettings& settings, const DisplacementField* deformation = nullptr) const;

 private:
  struct Ray;
  struct Tables;
  class Warp;
  [[nodiscard]] float trilinear(const Eigen::Vector3f& x) const;
  [[nodiscard]] Eigen::Vector3f gradient(const Eigen::Vector3f& x) const;
  [[nodiscard]] Eigen::Array4f march(const Ray& ray, const Tables& tables, const Warp* warp,
                                     const RenderSettings& settings) const;
  void measure_empty_bricks();

  static constexpr int kBrick = 4;
  const Volume& volume_;
  TransferFunction transfer_;
  Eigen::Vector3f last_;  ///< n - 1 on each axis
  Eigen::Matrix3f patient_gradient_from_voxel_;
  std::array<int, 3> bricks_{};
  /// Per brick of kBrick^3 cells: how many bricks away, along any axis or diagonal, the nearest one is that is seen.
  std::vector<std::uint8_t> empty_;
};

}  // namespace birdseye::host
