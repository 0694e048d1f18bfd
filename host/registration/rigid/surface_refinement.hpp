#pragma once

#include <span>
#include <string>

#include "calibration/geometry/transform.hpp"
#include "host/registration/rigid/surface.hpp"

namespace birdseye::host {

/// The fiducials that a surface refinement starts from and may not contradict.
struct FiducialAnchor {
  Transform<Patient, Tracker> patient_from_tracker;
  std::span<const Eigen::Vector3d> touched_in_tracker_mm;
  double localisation_rms_mm = 0;
  int degrees_of_freedom = 0;  ///< of localisation_rms_mm's estimate; 0: it is known
};

struct SurfaceRefinement {
  /// The refined pose; or the fiducials' own pose, where the surface would move it farther than they allow.
  Transform<Patient, Tracker> patient_from_tracker;
  Transform<Patient, Tracker> surface_pose;  ///< where the surface puts it, accepted or not
  bool accepted = false;
  std::size_t points = 0, places = 0, kept = 0;  ///< touched points, their places 3 mm apart, and how many count
  /// Distance of the touched points from the surface, root mean square of the nearest 90 %.
  double rms_before_mm = 0, rms_after_mm = 0;
  double moved_mm = 0;  ///< of the fiducials by the refinement, root mean square
  double turned_rad = 0;
  double allowed_mm = 0;  ///< what chance moves the fiducials by in 99 of 100 registrations, if the surface is right
  int iterations = 0;
  std::string told;  ///< in one line
};

/// Moves touched points onto the patient's surface: iterative closest points, with the distance along the surface's
/// normal (Y. Chen, G. Medioni, 1992), leaving out the farthest tenth of the points. Points within 3 mm of one another
/// are one place, their middle: a hand that holds still says no more than once. The fiducials keep their weight,
/// so that what the surface leaves open (a plane slides along itself) stays where the fiducials put it.
///
/// The fiducials are right to within their localisation error. A surface that moves them farther than that explains is
/// another surface, or was touched elsewhere: it is refused, and `told` says so. Refuses fewer than ten places
/// (Errc::degenerate) and coordinates that are not finite.
Result<SurfaceRefinement> refine_on_surface(const Surface& surface,
                                            std::span<const Eigen::Vector3d> touched_in_tracker_mm,
                                            const FiducialAnchor& anchor);

}  // namespace birdseye::host
