#pragma once

#include <Eigen/Core>
#include <functional>

#include "hw-sim/phantom/mesh.hpp"

namespace birdseye::hw_sim {

/// How the tissue in a box of the patient (LPS, mm) lies deformed: which place at rest each place now had, and the
/// other way round. One to one in the box and a margin about it.
class TissueMap {
 public:
  static constexpr double kLeastDeterminant = 0.3;  ///< of the map, below which a draw is thrown away

  virtual ~TissueMap() = default;

  /// From a place now to where its tissue lay at rest.
  [[nodiscard]] virtual Eigen::Vector3d displacement_mm(const Eigen::Vector3d& deformed_mm) const = 0;
  [[nodiscard]] Eigen::Vector3d rest_of(const Eigen::Vector3d& deformed_mm) const {
    return deformed_mm + displacement_mm(deformed_mm);
  }
  /// The inverse of rest_of, to 1e-9 mm.
  [[nodiscard]] virtual Eigen::Vector3d deformed_of(const Eigen::Vector3d& rest_mm) const = 0;
  /// d rest / d deformed.
  [[nodiscard]] virtual Eigen::Matrix3d jacobian(const Eigen::Vector3d& deformed_mm) const = 0;
  /// The least determinant of the Jacobian over a lattice; of maps that are given from rest, also of its inverse.
  [[nodiscard]] virtual double least_determinant() const = 0;

  [[nodiscard]] const Eigen::Vector3d& low_mm() const { return low_mm_; }
  [[nodiscard]] const Eigen::Vector3d& high_mm() const { return high_mm_; }

 protected:
  TissueMap(const Eigen::Vector3d& low_mm, const Eigen::Vector3d& high_mm) : low_mm_(low_mm), high_mm_(high_mm) {}
  TissueMap(const TissueMap&) = default;
  TissueMap& operator=(const TissueMap&) = default;

 private:
  Eigen::Vector3d low_mm_, high_mm_;
};

Mesh deformed(const Mesh& rest, const TissueMap& map);

/// The least value over a lattice of so many points an axis that spans a box.
double least_over_lattice(const Eigen::Vector3d& low_mm, const Eigen::Vector3d& high_mm, int points,
                          const std::function<double(const Eigen::Vector3d&)>& value_at);

}  // namespace birdseye::hw_sim
