#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "calibration/base/verdict.hpp"
#include "host/case/registration_case.hpp"
#include "host/files/picture.hpp"
#include "host/registration/views/view_registration.hpp"
#include "host/render/scene/scene.hpp"

namespace birdseye::host {

/// Similarity over the optimiser's evaluations.
std::string trace_svg(const std::vector<TracePoint>& trace);

/// The difference between the view's grey and the overlay's, once the overlay's is scaled to the view's: red where the
/// video is brighter, blue where it is darker; RGB.
std::vector<std::uint8_t> difference_picture(const VideoView& view, const ImageRgba& overlay);

/// The view with the organ's outline before, in orange and dashed, and after, in blue; where both are the same, blue.
/// before, after: the overlays, of the view's size, of which only the opacity counts.
Picture outline_picture(const Picture& view, const ImageRgba& before, const ImageRgba& after);

/// A report page; it shows pictures that lie beside its file.
std::string registration_report(const RegistrationCase& c, const ViewRegistration& found, const Verdict& verdict,
                                const nlohmann::json& json);

}  // namespace birdseye::host
