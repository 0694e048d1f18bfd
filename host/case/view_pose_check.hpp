#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "host/registration/views/synthetic_view.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// What the views' poses seem to be in place of camera_from_patient in mm with OpenCV's axes, in words that say what to
/// do: inverted, with OpenGL's axes, in metres, or of a patient frame in RAS; where by one of these alone all views see
/// the organ. Empty where the poses may be right, or none of these explains them. tissue: 1 at each voxel of the organ.
std::string fault_of_poses(std::span<const VideoView> views, const Volume& ct, const std::vector<std::uint8_t>& tissue);

}  // namespace birdseye::host
