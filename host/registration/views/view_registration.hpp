#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/deform/displacement_field.hpp"
#include "host/registration/views/control_grid.hpp"
#include "host/registration/views/multi_view.hpp"
#include "host/registration/views/tissue.hpp"

namespace birdseye::host {

/// One evaluation of the optimiser.
struct TracePoint {
  int reduction = 0;  ///< every so many pixels
  std::size_t parameters = 0;
  double similarity = 0;
};

/// For whoever waits for a registration: may cancel it. Called on the registration's threads.
struct RegistrationWatch {
  std::function<bool()> cancelled = [] { return false; };
};

struct ViewRegistrationSettings {
  /// Inner control points along each axis; none: as many as the views support.
  std::optional<std::array<int, 3>> control_points;
  /// Patches of the octree that carries the result: 2^level along each axis.
  int level = 5;
  /// Where to start; must not fold.
  std::optional<DisplacementField> initial;
  /// The lamp, where it is known; none: estimated from the views.
  std::optional<Headlight> light;
  bool estimate_uncertainty = true;
  /// Whether a rigid motion common to all views is found together with the deformation.
  bool refine_pose = false;
  Prior prior;
  /// Called with a line for a person now and then.
  std::function<void(const std::string&)> progress = [](const std::string&) {};
  RegistrationWatch watch;
};

struct ExpectedError {
  double rms_mm = 0;
  double radius95_mm = 0;  ///< the place is within, with a probability of 95 %
  /// Of its standard deviation before anything was seen, in the direction in which most of that is left; from 0 to 1.
  double left_of_prior = 1;
};

/// A side of the organ of which the views leave places open: across the surface there, over half of the standard
/// deviation is left that it had before anything was seen.
struct OpenSide {
  std::string side;   ///< left, right, front, back, top or underside, of the patient: where the surface there faces
  double share = 0;   ///< of its places that are open
  double rms_mm = 0;  ///< to be expected of those
};

/// The error to be expected of one place of the surface.
struct SurfacePlace {
  Eigen::Vector3d seen_mm;  ///< where it is now, patient frame
  double rms_mm = 0;
};

/// The error to be expected of places of the organ, by how the views see them.
struct ExpectedErrors {
  std::optional<ExpectedError> seen, hidden;  ///< of the surface; none where there is none of it
  std::optional<ExpectedError> surface, inside;
  std::vector<ExpectedError> targets;   ///< in the order in which they were asked for
  std::optional<double> seen_moved_mm;  ///< of the surface that is seen, root mean square
  std::vector<OpenSide> open;           ///< the sides of which most is open first; none: all are known
  std::vector<SurfacePlace> places;     ///< spread over the surface
};

/// How a place that something else than the views tells of fits the result.
struct PlaceFit {
  double off_mm = 0;  ///< along the directions in which it is known to 10 mm or better
  double weight = 0;  ///< 1: believed as its error says; to 0: not believed
  /// Off by more than one place of a hundred is by its error.
  [[nodiscard]] bool thought_wrong() const { return weight < 0.25; }
};

/// A view that a registration was found again without.
struct HeldOutView {
  std::size_t view = 0;        ///< of those that were given
  std::size_t places = 0;      ///< of its outline and by stereo with it
  double off_mm = 0;           ///< the median of how far they are from the surface that was found without it
  double expected_off_mm = 0;  ///< the same as it was to be expected
};

/// Standard deviations of the poses of views, per axis, apart from the error that all of them share.
struct PoseNoise {
  double eye_mm = 0, angle_rad = 0;
};

/// Poses of views, corrected by what the views show of one another.
struct AdjustedPoses {
  std::vector<Transform<Camera, Patient>> camera_from_patient;
  PoseNoise noise;          ///< of the poses that were given
  std::size_t matches = 0;  ///< of places between two views, those that agree
};

/// By what share the focal lengths of all views are too long, and its standard deviation.
struct FocalError {
  double share = 0, sigma = 0;
};

/// By how much a pose is moved.
struct PoseMove {
  double eye_mm = 0, turn_rad = 0;
};

/// A view that the others put elsewhere than its pose does, by more than chance.
struct OddView {
  std::size_t view = 0;
  PoseMove off;
  PoseNoise others;  ///< of the other views' poses
};

/// What places that were matched between the views say of lens and poses, once the surface is found.
struct ViewAgreement {
  FocalError focal;
  double stated_focal_sigma = 0;  ///< of that share, as the cameras' calibration states it; 0 where it does not
  std::optional<OddView> odd;     ///< the oddest; none is: empty
  std::size_t matches = 0;        ///< those that agree
};

/// What a deformation brings over none in views that it was not fitted to, each under the lamp that suits it: nats a
/// pixel, the mean over the views and its standard error.
struct HeldOutGain {
  double nats = 0, standard_error_nats = 0;
  /// So little that there is as good as no motion: under what more control points must bring, and in all views alike.
  [[nodiscard]] bool nothing_moved() const;
};

struct ViewRegistration {
  std::array<int, 3> control_points{};
  std::vector<double> parameters;  ///< mm, see ControlGrid
  DisplacementField field;         ///< rest = deformed + u(deformed)
  /// The correction of the given poses, where it was asked for: the pictures were taken from camera_from_patient *
  /// patient_from_model. The field is in the model's frame.
  std::optional<PoseUnknowns> pose;
  Transform<Patient, Patient> patient_from_model;
  Eigen::Vector3d centre_mm =
      Eigen::Vector3d::Zero();  ///< of the organ, about which the pose's correction turns; model's frame
  Headlight light;
  double similarity_before = 0, similarity_after = 0;   ///< mean over the views, nats, under the light found
  std::vector<double> per_view_before, per_view_after;  ///< empty with optimiser geometry, which renders nothing
  int evaluations = 0, gradient_evaluations = 0;
  std::vector<TracePoint> trace;
  double min_jacobian = 1;
  /// The error of the organ's surface that is to be expected, root mean square (confidence.hpp). None where it was not
  /// asked for or nothing better than the start was found.
  std::optional<double> uncertainty_mm;
  /// Only with optimiser geometry.
  std::optional<ExpectedErrors> expected;
  /// By how many nats what is seen speaks for the deformation and against none, tempered as hypotheses are; only with
  /// optimiser geometry.
  std::optional<double> evidence_of_motion_nats;
  /// Places of the surface that stereo between the views found; only with optimiser geometry.
  std::optional<std::size_t> stereo_points;
  /// Of each view, the median of how far its outline is from the surface that was found; none where it shows too little
  /// of one. Only with optimiser geometry.
  std::vector<std::optional<double>> outline_off_mm;
  /// Only with optimiser geometry, three views or more and enough to compare.
  std::optional<HeldOutView> held_out;
  /// Only with optimiser geometry, two views or more and enough matches.
  std::optional<ViewAgreement> agreement;
  /// Whether `expected` counts what the lens's error does: false where a view's camera does not state that error. Only
  /// with optimiser geometry.
  bool lens_error_counted = true;
  /// The poses by which the result was found; none: the given ones. Only with optimiser geometry.
  std::optional<AdjustedPoses> adjusted;
  /// Of the settings' touches and matched points; only with optimiser geometry, and none where the result folds.
  std::vector<PlaceFit> touches, matched;
  /// Of a fit of the same control points. None: it was not asked, for a start or a pose was given to be refined, or
  /// there are fewer than three views. Where nothing moved the result is no deformation. Only with optimiser gradient.
  std::optional<HeldOutGain> held_out_gain;
  std::string why_so_many_points;  ///< in words
  bool worse_than_start = false;   ///< the start is returned: the initial field itself, or none
  bool folded = false;             ///< the reason for that: every deformation that was found folds
  bool lamp_at_limit = false;      ///< the lamp is at the end of where it was searched
};

/// Deforms the tissue until synthetic views look like the video: L-BFGS with the analytic gradient, coarse to fine.
/// Refuses, naming the view, a view that sees nothing of the organ and a picture of a single grey; and a start that
/// folds, by itself or as the control points reproduce it. Errc::disconnected where the watch cancels.
Result<ViewRegistration> register_views(const std::vector<VideoView>& views, const Volume& ct, const Volume* labels,
                                        std::span<const int> label_values, const TransferFunction& transfer,
                                        const ViewRegistrationSettings& settings);

}  // namespace birdseye::host
