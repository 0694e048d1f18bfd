#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/camera_parameters.hpp"
#include "calibration/geometry/transform.hpp"
#include "calibration/picture/field_edge.hpp"
#include "calibration/time/clock.hpp"

namespace birdseye::host {

/// How well the scope is calibrated. What is absent has not been measured.
struct ScopeFigures {
  std::optional<double> camera_rms_px;  ///< of the lens's own calibration
  /// The board's corners against where tracker, hand-eye and lens put them, each station by a hand-eye that was found
  /// without it; root mean square. An overlay is drawn by that same chain, so this figure is the one that tells of it:
  /// the fit's own residual lets the tracker's poses move, and that of all stations has seen what it is judged by.
  std::optional<double> held_out_px;
  std::optional<double> held_out_mm;  ///< the same across the line of sight, at the board
  /// Of hand-eye, as errors e at a place p of the camera's frame: e = w x p + s, of w (rad) and s (mm), the shift at
  /// the camera itself. It says how hand-eye's error grows with the distance.
  std::optional<Eigen::Matrix<double, 6, 6>> hand_eye_covariance = std::nullopt;
  /// That held_out_mm rests on: of few it may be small by chance. Empty: it is not known how many they were.
  std::optional<int> hand_eye_stations = std::nullopt;
  std::optional<CameraMatrix> camera_covariance = std::nullopt;
  /// Of a rod that turns, or that had been turned to one angle when it was calibrated: whether somebody has said how it
  /// is turned now. Without that nobody knows where the camera sits, and nothing is drawn.
  bool rod_angle_missing = false;
};

/// Whether the video is seen to move as the scope's poses say.
enum class VideoAgreement {
  untold,    ///< the video has not shown enough yet
  agrees,    ///< it does
  in_doubt,  ///< it did, and the last picture does not: the next ones tell
  differs,   ///< it does not: the scope is turned in its holder, or another; or something has moved
};

/// How far a deformation may have the target off: root mean square, and within which it is with a probability of 95 %.
struct MotionError {
  double rms_mm = 0, radius95_mm = 0;
};

/// The figures by which it is judged whether an overlay may be drawn. What is absent is not known, and nothing is drawn
/// by it.
struct TrustFigures {
  ScopeFigures scope;
  std::optional<double> fre_mm;
  std::optional<double> target_mm;  ///< what the fiducials' error comes to at the target (registration_error_mm)
  /// Where the target is drawn: deformed, where the CT is. Empty: the errors that grow with its distance from the
  /// camera are not counted, as over a still.
  std::optional<Eigen::Vector3d> target_in_patient_mm = std::nullopt;
  std::optional<MotionError> motion_error = std::nullopt;  ///< empty: the organ's motion since the CT is not known
  /// How far the video shows the organ off the surface that is drawn, where that is more than chance. Empty: nothing
  /// says that it has moved.
  std::optional<double> moved_mm = std::nullopt;
  /// Empty: nobody looks, as where there is no video that moves.
  std::optional<VideoAgreement> video = std::nullopt;
  /// How large the video's round field is, against the one of the lens's calibration.
  calibration::FieldSize field = calibration::FieldSize::cannot_tell;
};

/// The one place where a figure that nobody knows counts as perfect: whoever gives a lens, a hand-eye or a pose in
/// files, which hold no figures, and asks for an overlay by them, answers for them. Figures that are stated stay.
TrustFigures vouched_for(const TrustFigures& stated);

/// The error to be expected at a target of a registration by fiducials, root mean square, mm. Few residuals may be
/// small by chance: counted is the bound under which the fiducials' localisation error lies, not its estimate.
/// fiducials_mm: at least three, not on a line, in the target's frame.
double registration_error_mm(double fre_mm, std::span<const Eigen::Vector3d> fiducials_mm,
                             const Eigen::Vector3d& target_mm);

/// How the scope's pose was known when a frame was taken.
struct FramePose {
  Transform<Camera, Patient> camera_from_patient;
  double position_sigma_mm = 0;             ///< of the frame's pose, each axis
  std::optional<double> jitter_mm;          ///< of single poses at the target; empty before there are enough
  std::optional<double> target_speed_mm_s;  ///< in the camera's frame; empty: it is not known
  Duration time_sigma{};                    ///< of the frame's time against the poses', as far as that is stated
  bool latency_known = false;               ///< the frame's time is corrected by a measured latency
};

/// By how much the times of a frame and of its pose may differ, one sigma. time_sigma: as far as that is stated.
double times_apart_s(Duration time_sigma, bool latency_known);

/// How far off the target may be drawn, as the sum of what is known to add to it: root mean squares of the error's
/// length in space, mm.
struct ErrorBudget {
  double fiducials_mm = 0;
  double hand_eye_mm = 0;  ///< at the target's distance from the camera
  double lens_mm = 0;      ///< at the target's place in the picture, beyond what hand-eye's error counts of it
  double pose_mm = 0;      ///< by which the frame's pose scatters, beyond what hand-eye's error counts of it
  double time_mm = 0;      ///< how far the target goes in the time that frame and pose may be apart
  std::optional<MotionError> motion;  ///< empty: how the organ has moved since the CT is not counted

  [[nodiscard]] double rigid_mm() const;     ///< of all but the motion
  [[nodiscard]] double rms_mm() const;       ///< of all that is counted
  [[nodiscard]] double radius95_mm() const;  ///< in the picture, it is within with a probability of 95 %
};

/// Empty where the registration's or hand-eye's error is not known, or where the target is.
std::optional<ErrorBudget> error_budget(const CameraModel& camera, const FramePose& pose, const TrustFigures& figures);

/// Where the overlay has the target, and how far from there it may be.
struct TargetMark {
  Eigen::Vector2d at_px;
  ErrorBudget error;
  double radius_px = 0;  ///< error.radius95_mm() in the picture
};

/// Empty where the target is out of view, or its error is not known.
std::optional<TargetMark> target_mark(const CameraModel& camera, const FramePose& pose, const TrustFigures& figures);

}  // namespace birdseye::host
