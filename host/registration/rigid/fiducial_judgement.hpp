#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/verdict.hpp"
#include "calibration/points/odd_points.hpp"
#include "calibration/points/point_shape.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// A fit of fiducials that is off by more says nothing of their shape, and is a fail.
inline constexpr double kLargestFre_mm = 5;

/// What speaks against fiducials by their shape and by where they lie, however well they fit.
struct FiducialJudgement {
  calibration::PointShape shape;
  bool mirrored = false;             ///< a fail: one of the two sets is the other's mirror image
  bool handedness_open = false;      ///< marginal: they lie so nearly in a plane that this cannot be told
  Grade scale = Grade::pass;         ///< of lengths in the CT over those that were touched
  bool along_axis = false;           ///< that scale is of one axis of the CT alone: shape.axis
  double axis_fre_rms_mm = 0;        ///< of the fit with that axis's scale
  std::vector<std::size_t> outside;  ///< a fail: by index, those that are nowhere at the CT's patient
  bool ras = false;                  ///< all would be inside if their places were in RAS
  std::string ct_reach;              ///< where the CT lies, in words; empty without a CT
};

/// ct_mm: the CT's fiducial of each touch. localisation_rms_mm: how well one is found and touched; empty: by the
/// residuals. odd: a touch that is off makes a scale of its own, which says nothing. ct: null where it is not at hand.
/// Three fiducials are always flat, of which is told elsewhere.
FiducialJudgement judge_fiducial_points(std::span<const Eigen::Vector3d> ct_mm,
                                        std::span<const Eigen::Vector3d> touched_mm,
                                        std::optional<double> localisation_rms_mm, const calibration::OddPoints& odd,
                                        const Volume* ct);

/// How many times as large as it was said to be the localisation error must be to leave such residuals in a rigid fit
/// of so many points. Empty where chance leaves as much in over 1 of 1000 sound sets, by their chi-square distribution.
std::optional<double> times_over_stated(double fre_rms_mm, std::size_t points, double localisation_rms_mm);

/// Of touches that fit no choice of markers, or fit it poorly: the judgement by the choice that their mirror image
/// fits, where it shows that they are mirrored.
std::optional<FiducialJudgement> find_mirrored(std::span<const Eigen::Vector3d> markers_in_patient_mm,
                                               std::span<const Eigen::Vector3d> touched_mm);

}  // namespace birdseye::host
