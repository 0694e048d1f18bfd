#pragma once

#include <Eigen/Core>
#include <functional>

#include "hw-sim/case/tissue_map.hpp"

namespace birdseye::hw_sim {

/// How far the tissue moves that lies at a place at rest, mm; smooth.
using MoveFromRest = std::function<Eigen::Vector3d(const Eigen::Vector3d& rest_mm)>;

/// A map that is given from rest. That way it is exact, and it is inverted by Newton's method to 1e-9 mm.
class ForwardMap final : public TissueMap {
 public:
  ForwardMap(const Eigen::Vector3d& low_mm, const Eigen::Vector3d& high_mm, MoveFromRest move_mm)
      : TissueMap(low_mm, high_mm), move_mm_(std::move(move_mm)) {}

  [[nodiscard]] Eigen::Vector3d displacement_mm(const Eigen::Vector3d& deformed_mm) const override;
  [[nodiscard]] Eigen::Vector3d deformed_of(const Eigen::Vector3d& rest_mm) const override;
  [[nodiscard]] Eigen::Matrix3d jacobian(const Eigen::Vector3d& deformed_mm) const override;
  /// Over the box and a tenth of it about it, from where tissue may have come into the box.
  [[nodiscard]] double least_determinant() const override;

 private:
  /// d deformed / d rest.
  [[nodiscard]] Eigen::Matrix3d stretch(const Eigen::Vector3d& rest_mm) const;

  MoveFromRest move_mm_;
};

}  // namespace birdseye::hw_sim
