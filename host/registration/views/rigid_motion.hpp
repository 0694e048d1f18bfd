#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "calibration/geometry/transform.hpp"
#include "host/registration/views/tissue.hpp"

namespace birdseye::host {

/// What a small rigid motion of some points does to a value: d(value) = force . shift + moment . turn, where each point
/// p moves by shift (mm) + turn (rad) x p. Named after statics, where forces on a body add up in the same way.
struct Wrench {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< value per mm
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  ///< value per rad

  /// Adds the part of one point, at which the value changes by by_point per mm.
  void add(const Eigen::Vector3d& point_mm, const Eigen::Vector3d& by_point) {
    force += by_point;
    moment += point_mm.cross(by_point);
  }
  Wrench& operator+=(const Wrench& other) {
    force += other.force;
    moment += other.moment;
    return *this;
  }
};

/// Six unknowns of a rigid motion, all in mm: shift, then turn (a rotation vector) times the organ's radius of
/// gyration, so that a step in any of them moves the organ about equally far, as ControlGrid's even coordinates do.
using PoseUnknowns = std::array<double, 6>;

/// The rigid motion between where the given poses have the patient and where the pictures show the patient. It turns
/// about the organ's centre, so that shift and turn pull little against one another.
class RigidMotion {
 public:
  explicit RigidMotion(const Tissue& tissue);

  /// Takes a place of the model (the CT's patient frame) to the patient frame of the given poses:
  /// patient = exp(turn) (model - centre) + centre + shift. The identity for zeros.
  [[nodiscard]] Transform<Patient, Patient> patient_from_model(const PoseUnknowns& unknowns) const;
  /// d(value)/d(unknowns), from the wrench on the cameras' rays, about the grid's origin and along its axes.
  [[nodiscard]] PoseUnknowns gradient(const PoseUnknowns& unknowns, const Wrench& on_rays) const;
  /// moves += what the motion adds to a displacement field as it is seen from the given poses, to first order: 3
  /// numbers a point of tissue's grid, mm along its axes.
  void add_to(const Tissue& tissue, const PoseUnknowns& unknowns, std::vector<float>& moves) const;

  [[nodiscard]] const Eigen::Vector3d& centre_mm() const { return centre_mm_; }  ///< of the organ, CT's patient frame
  [[nodiscard]] double gyration_mm() const { return gyration_mm_; }

 private:
  Eigen::Affine3d patient_from_grid_;
  Eigen::Vector3d centre_mm_ = Eigen::Vector3d::Zero();
  double gyration_mm_ = 1;
};

}  // namespace birdseye::host
