#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "host/registration/geometry/displacement_prior.hpp"
#include "host/volume/signed_distance.hpp"

namespace birdseye::host {

/// The softest ways in which an organ of one elastic material can move: the lowest modes of K x = lambda M x, K its
/// linear stiffness and M its mass (elastic_mesh.hpp).
class ElasticModes {
 public:
  static constexpr Eigen::Index kRigid = 6;  ///< of the modes, the first: motions of the whole organ

  /// Some 150 modes.
  static std::shared_ptr<const ElasticModes> of(const SignedDistance& organ);

  [[nodiscard]] Eigen::Index count() const { return eigenvalues_.size(); }
  /// Ascending; of Young's modulus 1 and density 1, lengths in mm. The rigid ones are 0 but for rounding.
  [[nodiscard]] const Eigen::VectorXd& eigenvalues() const { return eigenvalues_; }
  /// 3 x count(), of unit length in the mass. Far from the organ, as at its nearest place.
  [[nodiscard]] Eigen::Matrix3Xd at(const Eigen::Vector3d& place_in_patient_mm) const;
  /// A row a place: the displacement where each mode has such a share.
  [[nodiscard]] Eigen::MatrixX3d sum_at(const Eigen::VectorXd& shares, const Eigen::MatrixX3d& places) const;
  /// Mean square over the organ's surface, along each axis, of each mode.
  [[nodiscard]] const Eigen::VectorXd& mean_squares() const { return mean_squares_; }

 private:
  explicit ElasticModes(const SignedDistance& organ) : organ_(organ) {}
  struct Corners {
    std::array<int, 8> node;
    std::array<double, 8> weight;
  };
  [[nodiscard]] Corners corners_of(const Eigen::Vector3d& place_in_patient_mm) const;

  SignedDistance organ_;
  double side_mm_ = 0;
  std::array<int, 3> points_{};
  std::vector<int> node_of_point_;  ///< of the grid; -1 where there is none
  Eigen::VectorXd eigenvalues_, mean_squares_;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> modes_;  ///< a row of each node's component
};

/// What a white force within the organ does to it: modes with standard deviations as 1 / lambda, elastic_mm root mean
/// square along each axis over the organ's surface, and rigid motions of rigid_mm likewise.
class ElasticBasis : public DisplacementBasis {
 public:
  ElasticBasis(std::shared_ptr<const ElasticModes> modes, double rigid_mm, double elastic_mm);
  [[nodiscard]] Eigen::Index unknowns() const override { return modes_->count(); }
  [[nodiscard]] Eigen::Matrix3Xd at(const Eigen::Vector3d& place_in_patient_mm) const override;
  [[nodiscard]] Eigen::MatrixX3d sum_at(const Eigen::VectorXd& unknowns, const Eigen::MatrixX3d& places) const override;

 private:
  std::shared_ptr<const ElasticModes> modes_;
  Eigen::VectorXd sigmas_;
};

}  // namespace birdseye::host
