#pragma once

#include "host/registration/views/view_registration.hpp"

namespace birdseye::host {

inline constexpr std::size_t kFewestToHoldOut = 3;  ///< views

/// Fits the control points to some of the views, from no deformation on, and asks the others whether what was found
/// explains them better than no deformation does, until each view was asked once. What a model of the views gets wrong,
/// as the lamp or a texture, bends a fit to one view's pixels in a way that suits all of them, those too that were left
/// out; it does not suit another view, from which the lamp shines from elsewhere. views: kFewestToHoldOut or more.
Result<HeldOutGain> gain_on_held_out_views(const std::vector<VideoView>& views, const Tissue& tissue,
                                           const ControlGrid& control, const Headlight& light,
                                           const Headlight& light_of_none, const ViewRegistrationSettings& settings,
                                           ViewRegistration& record);

}  // namespace birdseye::host
