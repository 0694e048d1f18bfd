#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_parameters.hpp"
#include "host/case/point_rows.hpp"
#include "host/case/true_deformation.hpp"
#include "host/deform/displacement_field.hpp"
#include "host/files/picture.hpp"
#include "host/registration/views/multi_view.hpp"
#include "host/registration/views/synthetic_view.hpp"
#include "host/render/scene/transfer_function.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// What `birdseye register views` is given: docs/manual/registration.md describes the file.
struct RegistrationCase {
  Volume ct;
  std::optional<Volume> labels;
  std::vector<int> label_values;
  std::string transfer;
  /// Inner control points along each axis; empty for "auto".
  std::optional<std::array<int, 3>> control_points;
  int level = 5;
  std::string optimiser = "geometry";  ///< or gradient, or simplex, powell; only these two use the three below
  bool vertices = false;               ///< the unknowns are the free vertices of `level`
  std::string similarity = "mi";
  int most_evaluations = 400;
  bool refine_pose = false;  ///< only with gradient
  double pose_prior = Prior{}.pose;
  std::optional<DisplacementField> initial;
  std::vector<VideoView> views;
  std::vector<Picture> pictures;  ///< of the views, in colour
  /// Of the views' lenses, one a view; empty where a camera's file does not tell how well its lens is known.
  std::vector<std::optional<CameraMatrix>> camera_covariances;
  std::vector<std::string> notes;            ///< on what was read, to be told
  std::optional<Eigen::Vector3d> target_mm;  ///< what is to be hit, as the CT has it; none: the organ's inside
  std::vector<SeenPoint> surface_points;     ///< only with geometry, as is what is matched
  std::vector<NamedMatch> matched;           ///< landmarks that views show, then what the points' file has
  std::vector<Landmark> landmarks;           ///< the truth's
  std::optional<TrueDeformation> truth;
  /// What a refined pose should be: patient_from_model.
  std::optional<Transform<Patient, Patient>> true_pose;
};

/// Reads a case. Refuses, naming file and key: what is missing, what has another size than the case says, and two views
/// that are the same.
Result<RegistrationCase> read_case(const std::filesystem::path& path);

}  // namespace birdseye::host
