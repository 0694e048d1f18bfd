#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <vector>

#include "host/deform/displacement_field.hpp"
#include "host/volume/signed_distance.hpp"

namespace birdseye::host {

/// Displacements on a regular lattice over an organ's box, trilinear, held at the box's faces beyond. Of rest places
/// (seen = rest - w(rest)) or of seen places (rest = seen + u(seen)).
class LatticeField {
 public:
  /// Zero everywhere, over the box of an organ's signed distance.
  explicit LatticeField(const SignedDistance& organ);

  [[nodiscard]] Eigen::Vector3d at(const Eigen::Vector3d& place_in_patient_mm) const;
  [[nodiscard]] std::size_t size() const { return displacement_mm_.size(); }
  [[nodiscard]] const std::array<int, 3>& points() const { return points_; }
  [[nodiscard]] Eigen::Vector3d place_mm(std::size_t point) const;
  [[nodiscard]] Eigen::Vector3d displacement_mm(std::size_t point) const {
    return displacement_mm_[point].cast<double>();
  }
  void set(std::size_t point, const Eigen::Vector3d& displacement_mm) {
    displacement_mm_[point] = displacement_mm.cast<float>();
  }

 private:
  std::array<int, 3> points_{};
  double spacing_mm_;
  Eigen::Affine3d patient_from_box_, box_from_patient_;
  std::vector<Eigen::Vector3f> displacement_mm_;
};

/// A field over the box of an organ by a function of many places at once, a row a place: at every point near the organ;
/// further off, where a deformation is smooth, at every third along each axis and between these.
LatticeField sampled_field(const SignedDistance& organ,
                           const std::function<Eigen::MatrixX3d(const Eigen::MatrixX3d&)>& displacements_mm);

/// u of seen places from w of rest places: u(x) = w(x + u(x)).
LatticeField seen_from_rest(const LatticeField& rest);

/// Where tissue is seen that lay at rest_mm, by u of seen places.
Eigen::Vector3d seen_place(const LatticeField& seen, const Eigen::Vector3d& rest_mm);

/// The organ as it is seen: at x the distance of x + u(x). Exact on the surface; off it as good as u is smooth.
SignedDistance seen_distance(const SignedDistance& rest, const LatticeField& seen);

/// u over the box of a volume, as far as a level 5 octree resolves it.
DisplacementField field_over(const Volume& volume, const LatticeField& seen);

}  // namespace birdseye::host
