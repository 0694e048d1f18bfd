#pragma once

#include <string>

#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Which CT it is: SHA-256 of the voxels and of where they lie.
std::string ct_sha256(const Volume& ct);

}  // namespace birdseye::host
