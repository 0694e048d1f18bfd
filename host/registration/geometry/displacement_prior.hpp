#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <string>
#include <vector>

namespace birdseye::host {

/// A part of what is believed of a deformation before anything is seen: a Gaussian process, its three components
/// independent, with covariance sigma^2 exp(-distance^2 / (2 length^2)).
struct GaussianPart {
  double length_mm, sigma_mm;
};

/// Another part: a deformation of few unknowns, each of variance 1 before anything is seen.
class DisplacementBasis {
 public:
  DisplacementBasis() = default;
  DisplacementBasis(const DisplacementBasis&) = delete;
  DisplacementBasis& operator=(const DisplacementBasis&) = delete;
  virtual ~DisplacementBasis() = default;
  [[nodiscard]] virtual Eigen::Index unknowns() const = 0;
  /// 3 x unknowns: the displacement at a place, mm per unit of each unknown.
  [[nodiscard]] virtual Eigen::Matrix3Xd at(const Eigen::Vector3d& place_in_patient_mm) const = 0;
  /// A row a place: the displacement by unknowns that are known, mm.
  [[nodiscard]] virtual Eigen::MatrixX3d sum_at(const Eigen::VectorXd& unknowns, const Eigen::MatrixX3d& places) const;
};

/// The inner control points of a Bezier patch over a box, independent, of sigma_mm along each axis.
class BezierBasis : public DisplacementBasis {
 public:
  BezierBasis(const Eigen::Affine3d& patient_from_cube, const std::array<int, 3>& inner_points, double sigma_mm);
  [[nodiscard]] Eigen::Index unknowns() const override;
  [[nodiscard]] Eigen::Matrix3Xd at(const Eigen::Vector3d& place_in_patient_mm) const override;

 private:
  Eigen::Affine3d cube_from_patient_;
  std::array<int, 3> inner_;
  double sigma_mm_;
};

/// A push at one place: Gaussian dents of several widths and depths about it, each in any direction, of sigma_mm along
/// each axis.
class PushBasis : public DisplacementBasis {
 public:
  /// inwards: from the surface there into the organ, of unit length.
  PushBasis(const Eigen::Vector3d& place_in_patient_mm, const Eigen::Vector3d& inwards, double sigma_mm)
      : place_mm_(place_in_patient_mm), inwards_(inwards), sigma_mm_(sigma_mm) {}
  [[nodiscard]] Eigen::Index unknowns() const override;
  [[nodiscard]] Eigen::Matrix3Xd at(const Eigen::Vector3d& place_in_patient_mm) const override;

 private:
  Eigen::Vector3d place_mm_, inwards_;
  double sigma_mm_;
};

/// A hypothesis: what may move the organ.
struct DisplacementPrior {
  std::string name;
  std::vector<GaussianPart> parts;
  std::shared_ptr<const DisplacementBasis> basis;  ///< or none
  /// A function of the place where tissue is seen (rest = seen + u(seen)); else of where it was at rest (seen = rest -
  /// w(rest)), as tissue bends.
  bool of_seen = false;
  double log_belief = 0;  ///< before anything is seen, nats
  /// Of a displacement beside these, which has nothing to do with that of the place next to it and which no residual
  /// tells of: a standard deviation of each axis.
  double unfollowed_mm = 0;

  /// Of the displacement before anything is seen, mm^2, at a place that the function takes.
  [[nodiscard]] Eigen::Matrix3d covariance(const Eigen::Vector3d& place_in_patient_mm) const;
};

}  // namespace birdseye::host
