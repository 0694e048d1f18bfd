#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/base/verdict.hpp"
#include "calibration/points/odd_points.hpp"
#include "calibration/points/point_error.hpp"
#include "calibration/points/point_fit.hpp"
#include "host/case/fiducial_checks.hpp"
#include "host/files/picture.hpp"
#include "host/registration/rigid/fiducial_judgement.hpp"
#include "host/registration/rigid/surface.hpp"
#include "host/registration/rigid/surface_refinement.hpp"
#include "host/report/target_error_map.hpp"
#include "host/volume/volume.hpp"
#include "host/volume/volume_source.hpp"

namespace birdseye::host {

/// Where the markers lie, and what else is said of them.
struct FiducialFiles {
  std::filesystem::path ct, tracker;                       ///< the markers, and the same as touched
  std::filesystem::path targets, surface, surface_points;  ///< empty: none
  VolumeSource volume;                                     ///< the CT; without a path: none
  std::filesystem::path field;            ///< map that corrects what was touched; empty: it is as measured
  bool accept_unsigned = false;           ///< also by a map that no known machine signed
  std::optional<double> localisation_mm;  ///< how well a marker is found and touched, rms; none: from the residuals
  bool match = false;                     ///< touched in any order, of markers that may be more
};

/// What was read and asked for.
struct FiducialInput {
  std::vector<Eigen::Vector3d> ct_mm;  ///< in the order of touched_mm once matched
  std::vector<Eigen::Vector3d> touched_mm, targets_mm, surface_points_mm;
  std::optional<Volume> volume;
  std::optional<Surface> surface;
  std::vector<std::size_t> ct_of_touch;  ///< empty where the files' order or names hold
  std::vector<std::string> names;        ///< one for each touch where both files name their points; else empty
  std::vector<std::string> notes;        ///< what was done to the points, to be told
  std::string field_doubt;               ///< why the author of the map that corrected them is not known; empty: it is
};

/// All that was found out.
struct FiducialsFound {
  calibration::PointFit<Patient, Tracker> fit;
  calibration::LocalisationError localisation;  ///< as it was stated, unless the residuals refute that
  std::optional<double> times_over_stated;   ///< how many times the stated one the residuals are, where they refute it
  std::optional<double> rival_order_fre_mm;  ///< of points paired by order: of another order that fits as well
  calibration::OddPoints odd;
  FiducialJudgement judged;
  double ct_spread_mm = 0;                   ///< root mean square distance of the CT's markers from their middle
  std::vector<std::size_t> targets_outside;  ///< by index: those that are nowhere at the CT's patient
  std::optional<MarkersSeen> markers_seen;   ///< at the places of the CT's markers; none without a CT
  std::vector<double> tre_mm;
  std::optional<TargetErrorRange> range;
  std::optional<SurfaceRefinement> refinement;
  std::string misfit_advice;  ///< what to do where the points do not fit one another at all
  [[nodiscard]] const Transform<Patient, Tracker>& patient_from_tracker() const {
    return refinement ? refinement->patient_from_tracker : fit.to_from;
  }
};

/// Points pair by their names where both files name them (and `match` is not asked for), else by their order. With a
/// map of the field, touched points are corrected by it. A fiducial where it maps nothing is refused, by name; points
/// of the surface there are left out and counted in a note.
Result<FiducialInput> read_fiducials(const FiducialFiles& files);

/// Brings CT and tracker together by the markers, then by the surface if there is one. Brings ct_mm of the input into
/// the order of the touches.
Result<FiducialsFound> register_fiducials(const FiducialFiles& files, FiducialInput& input);

Verdict judge_fiducials(const FiducialsFound& found);
nlohmann::json fiducials_json(const FiducialInput& input, const FiducialsFound& found, const Verdict& verdict);
/// The predicted error in slices.
Picture fiducials_map(const FiducialInput& input, const FiducialsFound& found);

}  // namespace birdseye::host
