#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "calibration/geometry/transform.hpp"
#include "host/case/registration_case.hpp"
#include "host/deform/displacement_field.hpp"

namespace birdseye::host {

/// A place of the organ, patient mm: where it was when the CT was taken, and where it truly is in the views.
struct TruePlace {
  Eigen::Vector3d rest_mm, now_mm;
};
/// Places of one kind: "surface", all of it; of that "seen_by_two" views or more, "seen" by one or more, "seen_moved",
/// those of them that moved by 3 mm or more, and "hidden" from all; and "inside", deeper than 6 mm.
struct PlacesOfKind {
  std::string kind;
  std::vector<TruePlace> places;
};

/// Up to 2000 places spread evenly over the organ's surface, and as many inside. A view sees a place of the surface
/// that lies in its picture and in the lens's field, that faces it (by a tenth), and that no other of the organ lies
/// before, all with the organ and the camera where they truly are; instruments, glare and blood hide nothing. truth:
/// rest = now + u(now). true_poses: one a view.
Result<std::vector<PlacesOfKind>> true_places(const RegistrationCase& c, const TransferFunction& transfer,
                                              const DisplacementField& truth,
                                              std::span<const Transform<Camera, Patient>> true_poses);

/// How far places are from where they truly are, mm.
struct PlacesError {
  double mean_mm = 0, rms_mm = 0;
};
/// Of places that field (null: none) deforms.
PlacesError error_of(std::span<const TruePlace> places, const DisplacementField* field);

}  // namespace birdseye::host
