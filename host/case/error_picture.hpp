#pragma once

#include <optional>
#include <span>

#include "host/case/registration_case.hpp"
#include "host/case/run_registration.hpp"
#include "host/files/picture.hpp"
#include "host/volume/signed_distance.hpp"

namespace birdseye::host {

/// An organ from six sides, every place of it in the colour of the error that is to be expected there, with a scale in
/// mm. places: at least one, where the error is known; between them it is interpolated. target_mm: marked, even where
/// the organ hides it. Patient frame.
Picture draw_expected_error(const SignedDistance& organ, std::span<const SurfacePlace> places,
                            const std::optional<Eigen::Vector3d>& target_mm);

/// Of a registration, the organ as it is now; empty where nothing is said of the error to be expected.
std::optional<Picture> expected_error_picture(const RegistrationCase& c, const CaseRegistration& result);

}  // namespace birdseye::host
