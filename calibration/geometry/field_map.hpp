#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::calibration {

/// The functions that a map of the field is a sum of.
enum class FieldBasis {
  polynomial,  ///< products of Legendre polynomials of total degree up to the order, 1..4
  bernstein,   ///< tensor products of Bernstein polynomials of the order, 2..5, along each axis
  rbf,         ///< distances from as many centres as the order says (biharmonic in space), and an affine part
};
const char* name_of(FieldBasis basis);
std::optional<FieldBasis> field_basis_of(const std::string& name);

/// Functions over a box. Places are scaled to the box, -1..1 along each axis, so that coefficients do not depend on the
/// box's size.
struct FieldFunctions {
  static constexpr int kMostCentres = 200;
  static constexpr std::size_t kMost = 216;  ///< functions: 6^3 of Bernstein, 200 + 4 of distances

  FieldBasis basis = FieldBasis::polynomial;
  int order = 1;
  Eigen::Vector3d low_mm = Eigen::Vector3d::Zero(), high_mm = Eigen::Vector3d::Ones();
  std::vector<Eigen::Vector3d> centres_mm;  ///< `order` of them for rbf, else none

  [[nodiscard]] std::size_t count() const;
  /// All functions at a place, into the first count() of values (at least kMost long). The centres' come before the
  /// affine 1, x, y, z; Bernstein's with x fastest; polynomials by degree in z, then y, then x.
  void evaluate(const Eigen::Vector3d& position_mm, std::span<double> values) const;
  /// What makes no sense in these functions, in words; empty where all is well.
  [[nodiscard]] std::string fault() const;
};

/// A map of the field as it is stored: plain numbers.
struct FieldMapData {
  static constexpr std::size_t kNodes = 9;  ///< of the lattice of sigmas, along each axis

  FieldFunctions functions;
  std::vector<Eigen::Vector3d> position_mm;   ///< a coefficient for each function
  std::vector<Eigen::Vector3d> rotation_rad;  ///< as many, or none: orientation is left as it was measured
  /// How far a corrected position is off, RMS in space, on a lattice of kNodes^3 over the box, x fastest; negative
  /// where the field was not mapped.
  std::vector<double> sigma_mm;
};

/// Corrects the poses of a tracker whose field is bent by metal: they are off by amounts that depend on the place.
///   p_true = p + c(p),   R_true = exp(w(p)) R
/// with p and R as measured. Only where the field was mapped: a map says nothing about other places, so nothing is
/// extrapolated.
class FieldMap {
 public:
  /// What an overlay may be off by at all: a pose that the map may move by a larger error is no better than one without
  /// a map. Maps of version 0.1 have such places.
  static constexpr double kMostSigmaMm = 2.5;

  static Result<FieldMap> from(FieldMapData data);

  struct Corrected {
    Transform<Tracker, Sensor> tracker_from_sensor;
    double sigma_mm;  ///< RMS in space, of the position
  };
  /// Empty where the field was not mapped, or is not known to kMostSigmaMm.
  [[nodiscard]] std::optional<Corrected> correct(const Transform<Tracker, Sensor>& measured) const;
  /// c(p), mm, where correct() gives a pose.
  [[nodiscard]] std::optional<Eigen::Vector3d> correction_mm(const Eigen::Vector3d& position_mm) const;
  /// Empty where the field was not mapped: outside the box, and inside it where nothing was measured nearby.
  [[nodiscard]] std::optional<double> sigma_mm(const Eigen::Vector3d& position_mm) const;
  /// Why correct() gives nothing at a place, in words; empty where it gives a pose.
  [[nodiscard]] std::string why_not(const Eigen::Vector3d& position_mm) const;
  [[nodiscard]] bool maps_orientation() const { return !data_.rotation_rad.empty(); }
  [[nodiscard]] const FieldMapData& data() const { return data_; }

 private:
  explicit FieldMap(FieldMapData data) : data_(std::move(data)) {}

  FieldMapData data_;
};

}  // namespace birdseye::calibration
