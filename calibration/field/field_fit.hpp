#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/base/verdict.hpp"
#include "calibration/geometry/field_map.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::calibration {

/// A place of a board or plate whose position is known, and what the tracker made of a sensor there.
struct FieldSample {
  std::string name;                                   ///< for messages
  Eigen::Vector3d true_mm = Eigen::Vector3d::Zero();  ///< in the board's frame
  /// How the sensor was turned in the board's frame, up to one rotation that is the same for all samples; the identity
  /// where the sensor was held the same way at each place. Empty where not known: orientation is then not mapped.
  std::optional<Eigen::Matrix3d> true_rotation;
  Transform<Tracker, Sensor> measured;
};

struct FieldFitSettings {
  std::optional<FieldBasis> basis;  ///< empty: the one that does best on samples it was not shown
};

/// What one kind of map makes of regions it was not shown, mm RMS.
struct FieldCandidate {
  FieldBasis basis = FieldBasis::polynomial;
  int order = 1;
  double smoothing = 0;
  double held_out_mm = std::numeric_limits<double>::infinity();
};

/// One measurement, before and after.
struct FieldResidual {
  std::string name;
  Eigen::Vector3d measured_mm;
  Eigen::Vector3d before_mm;    ///< measured less true
  Eigen::Vector3d held_out_mm;  ///< the same after a map that was not shown the measurement's region
  bool outlier = false;
  bool beside_outlier = false;  ///< an outlier with another one next to it: the field, and not mapped about it
  /// Without its region the map would be extrapolated here, at a corner of the volume say: held_out_mm tells then of
  /// the extrapolation, not of the map, and is not counted.
  bool beyond = false;
};

/// A level of the board's grid of which the places lie off the others' all alike: a spacer of another height, a board
/// that was moved sideways, a row that was written down as the next.
struct ShiftedLevel {
  int axis = 2;                                        ///< of the board, across which the level lies
  std::size_t level = 0;                               ///< from 1, the lowest
  double at_mm = 0;                                    ///< where it is said to be on that axis
  Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();  ///< measured less said, in the board's frame
};

struct FieldFit {
  explicit FieldFit(FieldMap found) : map(std::move(found)) {}

  FieldMap map;
  bool from_pairs = false;  ///< of two sensors on one body, else of known places
  FieldCandidate chosen;
  std::vector<FieldCandidate> candidates;
  std::vector<FieldResidual> residuals;       ///< all measurements, in their order
  double before_mm = 0, before_worst_mm = 0;  ///< RMS and largest, without outliers
  /// After correction, of regions that were left out, as far as the map without them reaches. The noise of the
  /// measurements is in it.
  double held_out_mm = 0, held_out_worst_mm = 0;
  std::string worst;                               ///< its name
  std::optional<double> before_deg, held_out_deg;  ///< RMS, where orientation was mapped
  double mapped_part = 0;                          ///< of the box about the places, 0..1
  std::optional<double> sigma95_mm;  ///< the map's own sigma: 95 % of what is mapped has less; empty: nothing is
  std::optional<Transform<Tracker, Marker>> tracker_from_board;
  /// Grid: how much longer the tracker has distances than the board, as a factor, and along each of the board's axes.
  /// Pairs: 1.
  double scale = 1;
  Eigen::Vector3d stretch = Eigen::Vector3d::Ones();
  std::optional<ShiftedLevel> shifted_level;  ///< grid
  /// Pairs: where sensor b is in a's frame, mm; and how well the body's turns span space, 0..1/3 (the least variance of
  /// the direction from a to b).
  std::optional<Eigen::Vector3d> a_from_b_mm;
  double direction_spread = 0;
  std::optional<double> stated_distance_mm;  ///< pairs: without it the map's scale is as it was measured
  double measured_distance_mm = 0;           ///< pairs: from sensor to sensor, median
};

/// The map that takes measured poses to where the board has them. The board's own place in the tracker's frame is not
/// known: it is the rigid fit of all samples (K. S. Arun et al., 1987), and distortion is what is left. A part of the
/// distortion that moves everything alike is therefore taken for the board's place. That makes no difference to
/// anything that is calibrated with the corrected tracker. All families of functions hold the affine maps, so that the
/// choice of the rigid part loses nothing.
/// Family, order and smoothing are those with the least error in regions that were left out (11 folds of scattered
/// cells, each a fifth of the box wide); within 2 % the one with fewer functions. Samples more than 4.5 robust sigmas
/// off are named and not used; where such samples lie next to one another, the field bends there as no map of these
/// samples follows it, and the map leaves the places about them out. Orientations, where known, get a map of the same
/// family from w = log(R_board turned_i sensor R_i^T). Where all samples are turned alike, the mean of w cannot be told
/// from how the sensor sits in its holder, and is taken for that. Refuses fewer than 30 samples, samples in a plane or
/// thinner than 100 mm along their own axes, places at two levels, places that are not finite, a grid of which the
/// measured places are the mirror image, and units that differ (a factor beyond 0.8..1.25).
Result<FieldFit> fit_field(std::span<const FieldSample> samples, const FieldFitSettings& settings = {});

/// What a map is good for, from its own figures.
Verdict verdict_of(const FieldFit& fit);

}  // namespace birdseye::calibration
