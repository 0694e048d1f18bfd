#pragma once

#include "host/files/picture.hpp"

namespace birdseye::host {

/// What covers the video when the window stands still, to be shown side by side.
Picture stall_picture(float scale);

}  // namespace birdseye::host
