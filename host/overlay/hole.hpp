#pragma once

#include "host/render/scene/scene.hpp"

namespace birdseye::host {

/// The overlay as it shows through a round hole about the picture's middle: nothing outside; inside, the overlay before
/// a ground that darkens what is behind, the more so at the hole's wall, so that it reads as a cavity; a light rim.
/// radius: as a part of the picture's height.
ImageRgba in_hole(const ImageRgba& overlay, double radius);

}  // namespace birdseye::host
