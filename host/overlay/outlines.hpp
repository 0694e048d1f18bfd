#pragma once

#include "host/render/scene/scene.hpp"

namespace birdseye::host {

/// The outlines of what a picture shows: where something begins against nothing, and where one colour begins against
/// another. A line is about a 220th of the picture's height wide, lies within what it bounds, has its colour without
/// shading, and a dark edge, so that it is seen on bright and on dark video.
ImageRgba outlines_of(const ImageRgba& drawn);

}  // namespace birdseye::host
