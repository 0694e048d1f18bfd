#include "host/registration/views/rigid_motion.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/geometry/rotations.hpp"

namespace birdseye::host {

RigidMotion::RigidMotion(const Tissue& tissue) : patient_from_grid_(tissue.patient_from_grid) {
  const double step_mm = tissue.spacing_mm.mean();
  double mass = 0, second = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  for (int z = 0; z < tissue.points[2]; ++z) {
    for (int y = 0; y < tissue.points[1]; ++y) {
      for (int x = 0; x < tissue.points[0]; ++x) {
        // A point is a cell of the grid about it, of which the boundary may leave a part outside.
        const double steps_deep = static_cast<double>(tissue.depth_mm[grid_index(tissue.points, x, y, z)]) / step_mm;
        const double share = std::clamp(0.5 + steps_deep, 0.0, 1.0);
        const Eigen::Vector3d p = Eigen::Vector3d(x, y, z).cwiseProduct(tissue.spacing_mm);
        mass += share;
        first += share * p;
        second += share * p.squaredNorm();
      }
    }
  }
  const Eigen::Vector3d centre_on_grid_mm = first / mass;
  centre_mm_ = patient_from_grid_ * centre_on_grid_mm;
  gyration_mm_ = std::max(1.0, std::sqrt(std::max(0.0, second / mass - centre_on_grid_mm.squaredNorm())));
}

Transform<Patient, Patient> RigidMotion::patient_from_model(const PoseUnknowns& x) const {
  const Eigen::Matrix3d r = rotation_exp(Eigen::Vector3d(x[3], x[4], x[5]) / gyration_mm_);
  return {r, centre_mm_ - r * centre_mm_ + Eigen::Vector3d(x[0], x[1], x[2])};
}

PoseUnknowns RigidMotion::gradient(const PoseUnknowns& x, const Wrench& on_rays) const {
  // A place q of a ray, which stays in the given frame, is seen at the model's p = exp(-w) (q - c - t) + c. So
  // dp/dt = -exp(-w), and a change dw turns p about c by -right_jacobian(w) dw.
  const Eigen::Vector3d w = Eigen::Vector3d(x[3], x[4], x[5]) / gyration_mm_;
  const Eigen::Vector3d centre_on_grid_mm = patient_from_grid_.inverse(Eigen::Isometry) * centre_mm_;
  const Eigen::Vector3d about_centre = on_rays.moment - centre_on_grid_mm.cross(on_rays.force);
  const Eigen::Matrix3d patient_from_grid = patient_from_grid_.linear();
  const Eigen::Vector3d by_shift = -(rotation_exp(w) * (patient_from_grid * on_rays.force));
  const Eigen::Vector3d by_turn = -(right_jacobian(w).transpose() * (patient_from_grid * about_centre)) / gyration_mm_;
  return {by_shift.x(), by_shift.y(), by_shift.z(), by_turn.x(), by_turn.y(), by_turn.z()};
}

void RigidMotion::add_to(const Tissue& tissue, const PoseUnknowns& unknowns, std::vector<float>& moves) const {
  const Transform<Patient, Patient> model_from_patient = patient_from_model(unknowns).inverse();
  const Eigen::Affine3d grid_from_patient = patient_from_grid_.inverse(Eigen::Isometry);
  for (int z = 0; z < tissue.points[2]; ++z) {
    for (int y = 0; y < tissue.points[1]; ++y) {
      for (int x = 0; x < tissue.points[0]; ++x) {
        const Eigen::Vector3d p = Eigen::Vector3d(x, y, z).cwiseProduct(tissue.spacing_mm);
        const Eigen::Vector3d move = grid_from_patient * (model_from_patient * (patient_from_grid_ * p)) - p;
        float* const to = &moves[3 * grid_index(tissue.points, x, y, z)];
        for (int axis = 0; axis < 3; ++axis) to[axis] += static_cast<float>(move[axis]);
      }
    }
  }
}

}  // namespace birdseye::host
