#pragma once

#include <Eigen/Core>
#include <limits>
#include <span>

#include "hw-sim/camera/laparoscope.hpp"
#include "hw-sim/camera/solid_noise.hpp"

namespace birdseye::hw_sim {

/// How a point answers the lamp: the share of each colour it scatters, and the strength of its highlight.
struct Reflectance {
  Eigen::Vector3f albedo;
  float gloss = 0;
};

enum CavityGeometry : unsigned { kOrganGeometry = 0, kWallGeometry = 1, kInstrumentGeometry = 2 };

/// What the surfaces in a cavity look like, by where they were at rest.
class CavityCoat {
 public:
  /// noise: of the patterns; must outlive this.
  CavityCoat(const SolidNoise& noise, const Cavity& cavity);

  [[nodiscard]] Reflectance at(const Eigen::Vector3f& rest_mm, unsigned geometry) const;

 private:
  [[nodiscard]] Reflectance bare(const Eigen::Vector3f& rest_mm, unsigned geometry) const;
  /// High where blood gathers first.
  [[nodiscard]] float puddle(const Eigen::Vector3f& rest_mm) const;

  const SolidNoise& noise_;
  Coat coat_;
  float texture_, wet_;
  float blood_from_ = std::numeric_limits<float>::max();  ///< covers the organ where puddle() is above
};

}  // namespace birdseye::hw_sim
