#pragma once

#include <Eigen/Core>
#include <vector>

namespace birdseye::hw_sim {

/// Spreads light over a picture by a Gaussian of so many pixels; what falls beyond its edge is lost. width_px *
/// height_px values, row by row.
void blur(std::vector<Eigen::Vector3f>& light, int width_px, int height_px, double sigma_px);

}  // namespace birdseye::hw_sim
