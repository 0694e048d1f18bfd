#pragma once

#include "host/report/slice_picture.hpp"

namespace birdseye::host {

/// The colour of a share from 0 to 1, beyond which its ends are kept: dark violet over green to yellow, of even steps
/// in brightness, for prints without colours and for the colour-blind (viridis).
Colour even_colour(double share);

}  // namespace birdseye::host
