#pragma once

#include <optional>
#include <span>
#include <vector>

#include "host/registration/geometry/pinhole_view.hpp"
#include "host/registration/geometry/seen_surface.hpp"
#include "host/registration/geometry/texture_matches.hpp"
#include "host/registration/views/view_registration.hpp"

namespace birdseye::host {

/// Holds lens and poses against matches: by bundle adjustments in which all focal lengths may err by one share, and in
/// which one view's pose after the other is left to the other views. given: with the poses as they were given. Empty
/// where too few matches agree.
std::optional<ViewAgreement> view_agreement(const std::vector<PinholeView>& given,
                                            std::span<const TextureMatch> matches);

/// The same by matches of the surface's texture, looked for as the views were placed at last, which is close by.
std::optional<ViewAgreement> view_agreement(const std::vector<PinholeView>& given,
                                            const std::vector<PinholeView>& placed, const SeenSurface& surface);

}  // namespace birdseye::host
