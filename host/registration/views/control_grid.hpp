#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "host/deform/bezier_patch.hpp"

namespace birdseye::host {

/// The inner control points of a Bezier patch over a box, as the unknowns of a registration: n along each axis, so of
/// degree n + 1. Displacements in mm along the box's axes; three numbers a point, x fastest.
class ControlGrid {
 public:
  explicit ControlGrid(const std::array<int, 3>& inner_points);

  [[nodiscard]] const std::array<int, 3>& inner_points() const { return inner_; }
  [[nodiscard]] std::size_t parameters() const;

  /// The same deformation by more control points: raising a Bezier patch's degree is exact. Parameters of `finer`,
  /// which has no fewer points on any axis.
  [[nodiscard]] std::vector<double> refine(const std::vector<double>& parameters, const ControlGrid& finer) const;

  /// The Bezier patch with these parameters, in units of the box.
  [[nodiscard]] BezierPatch patch(const std::vector<double>& parameters, const Eigen::Vector3d& box_mm) const;

  /// The mean of |du/dx|^2 over the box: how much the deformation strains what it moves. Adds weight times its gradient
  /// to gradient.
  double strain(const std::vector<double>& parameters, const Eigen::Vector3d& box_mm, double weight,
                std::vector<double>& gradient) const;

  /// Control points are far from independent: neighbours pull against one another. In `even` coordinates the sum of
  /// squares is the mean of |u|^2 over the box, so that an optimiser's steps have a like effect in all directions.
  [[nodiscard]] std::vector<double> from_even(const std::vector<double>& even) const;
  [[nodiscard]] std::vector<double> to_even(const std::vector<double>& parameters) const;
  /// d(value)/d(even) from d(value)/d(parameters).
  [[nodiscard]] std::vector<double> gradient_to_even(const std::vector<double>& by_parameters) const;

 private:
  /// Applies one matrix along each axis.
  [[nodiscard]] std::vector<double> apply(const std::array<Eigen::MatrixXd, 3>& along,
                                          const std::vector<double>& parameters) const;
  std::array<int, 3> inner_{};
  std::array<Eigen::MatrixXd, 3> mass_, stiffness_;     ///< of the inner Bernstein polynomials of each axis
  std::array<Eigen::MatrixXd, 3> root_, inverse_root_;  ///< upper triangles: mass = root^T root
};

/// The displacements that a control grid gives at the points of a regular grid over the box; and back again, what a
/// change at those points means for the control points. Both are computed one axis after another.
class ControlledGrid {
 public:
  /// points: of the regular grid, along each axis, the first and the last on the box's faces.
  ControlledGrid(const ControlGrid& control, const std::array<int, 3>& points);

  /// out: 3 numbers a point, mm, x fastest.
  void displacements(const std::vector<double>& parameters, std::vector<float>& out) const;
  /// parameters_gradient += d(value)/d(parameters), from d(value)/d(displacement) of each point.
  void pull_back(const std::vector<float>& by_displacement, std::vector<double>& by_parameters) const;

 private:
  std::array<int, 3> inner_{}, points_{};
  std::array<std::vector<double>, 3> basis_;  ///< points x inner, of each axis
};

}  // namespace birdseye::host
