#pragma once

#include <cstdint>
#include <vector>

#include "calibration/base/image_view.hpp"

namespace birdseye::host {

/// How much of each pixel of the video, 0 to 255, is to stay before an overlay so that what is drawn reads as lying
/// beneath the surface: its edges, folds and highlights. An overlay that hides them seems to float before the organ
/// (Kalkofen et al., Interactive focus and context visualization for augmented reality, ISMAR 2007).
/// Empty of a picture that is not whole.
std::vector<std::uint8_t> surface_cues(const RgbView& video);

}  // namespace birdseye::host
