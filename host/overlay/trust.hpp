#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::host {

/// How well the scope is calibrated. What is absent has not been measured.
struct ScopeFigures {
  std::optional<double> camera_rms_px;  ///< of the lens's own calibration
  /// The board's corners against where tracker, hand-eye and lens put them, each station by a hand-eye that was found
  /// without it; root mean square. An overlay is drawn by that same chain, so this figure is the one that tells of it:
  /// the fit's own residual lets the tracker's poses move, and that of all stations has seen what it is judged by.
  std::optional<double> held_out_px;
  std::optional<double> held_out_mm;  ///< the same across the line of sight, at the board
};

/// The figures by which it is judged whether an overlay may be drawn. What is absent is not known, and nothing is drawn
/// by it.
struct TrustFigures {
  ScopeFigures scope;
  std::optional<double> fre_mm;
  std::optional<double> target_mm;  ///< what the fiducials' error comes to at the target (registration_error_mm)
  /// How far the video shows the organ off the surface that is drawn, where that is more than chance. Empty: nothing
  /// says that it has moved.
  std::optional<double> moved_mm = std::nullopt;
};

/// The one place where a figure that nobody knows counts as perfect: whoever gives a lens, a hand-eye or a pose in
/// files, which hold no figures, and asks for an overlay by them, answers for them. Figures that are stated stay.
TrustFigures vouched_for(const TrustFigures& stated);

/// The error to be expected at a target of a registration by fiducials, root mean square, mm. Few residuals may be
/// small by chance: counted is the bound under which the fiducials' localisation error lies, not its estimate.
/// fiducials_mm: at least three, not on a line, in the target's frame.
double registration_error_mm(double fre_mm, std::span<const Eigen::Vector3d> fiducials_mm,
                             const Eigen::Vector3d& target_mm);

/// Where the overlay has the target, and how far from there it may be.
struct TargetMark {
  Eigen::Vector2d at_px;
  double rms_mm = 0;                    ///< the error that is to be expected, as a length in space
  double radius_px = 0, radius_mm = 0;  ///< in the picture, it is within with a probability of 95 %, as far as counted
  bool motion_counted = false;          ///< whether that counts how the organ has moved since the CT
};

/// How far a deformation may have the target off: root mean square, and within which it is with a probability of 95 %.
struct MotionError {
  double rms_mm = 0, radius95_mm = 0;
};

/// One frame as the target is seen in it.
struct TargetView {
  CameraModel camera;
  Transform<Camera, Patient> camera_from_patient;
  Eigen::Vector3d target_in_patient_mm;     ///< where it is shown: deformed, where the CT is
  double position_sigma_mm = 0;             ///< of the frame's pose, each axis
  std::optional<double> jitter_mm;          ///< of single poses at the target; empty before there are enough
  std::optional<MotionError> motion_error;  ///< empty: the organ's motion since the CT is not known
};

/// Empty where the target is out of view, or hand-eye's or the registration's error is not known.
std::optional<TargetMark> target_mark(const TargetView& view, const TrustFigures& figures);

}  // namespace birdseye::host
