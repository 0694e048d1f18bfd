#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/image_view.hpp"
#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_parameters.hpp"
#include "host/registration/geometry/matched_point.hpp"
#include "host/registration/geometry/organ_at_rest.hpp"
#include "host/registration/geometry/seen_point.hpp"
#include "host/registration/views/view_registration.hpp"

namespace birdseye::host {

struct GeometrySettings {
  /// Inner control points of the Bezier patches that are among the hypotheses.
  std::array<int, 3> control_points{3, 3, 3};
  bool estimate_uncertainty = true;
  /// Places whose expected error is asked for, of the organ as the CT has it, patient frame.
  std::vector<Eigen::Vector3d> targets_at_rest_mm;
  /// Places that are on the organ's surface now, whatever tells of them: a pointer's tip, another modality. No camera
  /// sees them.
  std::vector<SeenPoint> touches;
  /// Whether the touches are of strokes: those close together are told as one, for their errors are alike, and the
  /// result's touches are the gathered ones. Else they are rows, of which those close together that agree count as one
  /// (gathered_rows), and the result tells of each.
  bool gather_touches = false;
  /// How well each view's lens is known: what that does to the places counts in every error that is to be expected.
  /// None at all, or one a view; an empty one: its lens is taken for exact.
  std::vector<std::optional<CameraMatrix>> camera_covariances;
  std::vector<MatchedPoint> matched;  ///< what is known both at rest and now
  /// Registers the views by similarity of renderings: asked once, where stereo finds little. What it finds are further
  /// places of the surface, of a large error that neighbours share. Empty: stereo, outlines and touches alone tell.
  std::function<Result<DisplacementField>(const std::vector<VideoView>& views)> by_similarity;
  /// Called with a line for a person now and then.
  std::function<void(const std::string&)> progress = [](const std::string&) {};
  /// Called after each round with its number, from 1, how many there are, and the places of the surface that were
  /// found.
  std::function<void(std::size_t round, std::size_t rounds, std::size_t places)> round_done =
      [](std::size_t, std::size_t, std::size_t) {};
  RegistrationWatch watch;
};

/// Deforms the organ until its surface lies where the views show it: places found by stereo between the views and by
/// the organ's outlines, and the touches and matched points of the settings, under several priors, each believed as far
/// as its evidence goes; their mean. Nothing is compared with a rendering. pictures: of the views, in colour;
/// organ: of the CT.
/// Refuses what register_views() refuses, and a touch or a matched point without a positive error; Errc::not_found
/// where no place of the surface is found, and Errc::disconnected where the watch cancels. A field that folds is not
/// returned: folded, and no deformation.
Result<ViewRegistration> register_geometry(const std::vector<VideoView>& views, std::span<const RgbView> pictures,
                                           const Volume& ct, const OrganAtRest& organ,
                                           const GeometrySettings& settings);

}  // namespace birdseye::host
