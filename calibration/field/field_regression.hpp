#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calibration/geometry/field_map.hpp"

/// What both fits of the field stand on: smoothed least squares, judged on regions that were left out.
namespace birdseye::calibration::detail {

/// Eleven parts of a box cut into 5x5x5 cells: cell (i, j, k) belongs to part (i + 3j + 5k) mod 11, so that none of its
/// 26 neighbours belongs to the same part. A cell that is left out thus has data all around it and none inside.
inline constexpr int kFolds = 11;
int fold_of(const FieldFunctions& box, const Eigen::Vector3d& position_mm);

/// Coefficients = embedding * parameters; penalty: a quadratic form of the parameters, zero for affine maps (trilinear
/// ones for Bernstein), larger the rougher the map.
struct SmoothedBasis {
  FieldFunctions functions;
  Eigen::MatrixXd embedding;
  Eigen::MatrixXd penalty;

  [[nodiscard]] Eigen::Index size() const { return embedding.cols(); }
  /// Of the parameters, at a place: a row of size().
  [[nodiscard]] Eigen::RowVectorXd row(const Eigen::Vector3d& position_mm) const;
};

/// Polynomials: (degree - 1)^4 times the square of each coefficient of degree 2 and up. Bernstein: squared second
/// differences of the control values along each axis (P. H. C. Eilers and B. D. Marx, 1996). Distances: the bending
/// energy of their sum, weights orthogonal to affine maps (G. Wahba, Spline Models for Observational Data, 1990).
SmoothedBasis smoothed(FieldFunctions functions);

/// `count` of the places, each as far as can be from those before it.
std::vector<Eigen::Vector3d> spread_out(std::span<const Eigen::Vector3d> places_mm, std::size_t count);

/// The normal equations, kept apart by fold.
struct FoldedNormals {
  std::vector<Eigen::MatrixXd> gram, moment;  ///< of kFolds each: sum of r^T r, sum of r^T y
  Eigen::MatrixXd penalty;                    ///< scaled to the trace of the gram by scale_penalty()
  double ridge = 0;                           ///< keeps it invertible where rounding would not

  FoldedNormals(Eigen::Index parameters, Eigen::Index columns);
  void add(int fold, const Eigen::MatrixXd& rows, const Eigen::MatrixXd& values);
  void scale_penalty(const Eigen::MatrixXd& rough);

  struct Solution {
    Eigen::MatrixXd parameters;
    Eigen::MatrixXd inverse;  ///< of the normal matrix: the covariance for noise of variance 1
  };
  /// left_out: the fold that is not looked at, or -1. smoothing: weight of the penalty.
  [[nodiscard]] Solution solve(double smoothing, int left_out) const;
};

inline constexpr double kSmoothings[] = {1e-8, 1e-6, 1e-4, 1e-3, 1e-2, 1e-1, 1};

/// Where a node of the lattice of sigmas lies.
Eigen::Vector3d place_of_node(const FieldFunctions& box, std::size_t node);

/// The lattice of sigmas: at each node, `at(place)`, or -1 where no place is within reach, and where the map itself is
/// not sure to FieldMap::kMostSigmaMm: at places that lie side by side and yet do not tell how the field bends between
/// them.
template <typename At>
std::vector<double> sigma_lattice(const FieldFunctions& box, std::span<const Eigen::Vector3d> places_mm,
                                  double reach_mm, const At& at) {
  constexpr std::size_t kNodes = FieldMapData::kNodes;
  std::vector<double> out;
  for (std::size_t node = 0; node < kNodes * kNodes * kNodes; ++node) {
    const Eigen::Vector3d place = place_of_node(box, node);
    double nearest = 1e300;
    for (const Eigen::Vector3d& p : places_mm) nearest = std::min(nearest, (p - place).squaredNorm());
    const double sigma_mm = nearest <= reach_mm * reach_mm ? at(place) : -1;
    out.push_back(sigma_mm <= FieldMap::kMostSigmaMm ? sigma_mm : -1);
  }
  return out;
}

/// How far from a measured place the field still counts as mapped: somewhat farther than the places are from each
/// other, and at least an eighth of the box's diagonal.
double reach_mm(const FieldFunctions& box, std::span<const Eigen::Vector3d> places_mm);

}  // namespace birdseye::calibration::detail
