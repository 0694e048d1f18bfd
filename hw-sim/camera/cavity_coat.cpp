#include "hw-sim/camera/cavity_coat.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace birdseye::hw_sim {

using Eigen::Vector3f;

CavityCoat::CavityCoat(const SolidNoise& noise, const Cavity& cavity)
    : noise_(noise),
      coat_(cavity.coat),
      texture_(static_cast<float>(cavity.texture)),
      wet_(static_cast<float>(cavity.wet)) {
  const std::vector<Vector3f>& surface = cavity.rest_mm.empty() ? cavity.organ.vertices : cavity.rest_mm;
  if (!(cavity.blood > 0) || surface.empty()) return;
  // Vertices lie evenly on the surface: the share of them that is covered is the share of its area.
  std::vector<float> levels;
  levels.reserve(surface.size());
  for (const Vector3f& p : surface) levels.push_back(puddle(p));
  const auto dry =
      static_cast<std::ptrdiff_t>((1 - std::min(1.0, cavity.blood)) * static_cast<double>(levels.size() - 1));
  std::nth_element(levels.begin(), levels.begin() + dry, levels.end());
  blood_from_ = levels[static_cast<std::size_t>(dry)];
}

Reflectance CavityCoat::at(const Vector3f& rest_mm, unsigned geometry) const {
  Reflectance out = bare(rest_mm, geometry);
  if (geometry == kOrganGeometry && blood_from_ < std::numeric_limits<float>::max()) {
    constexpr float kEdge = 0.03F;  // of puddle(): some mm, over which the film of blood grows thin
    const float covered = std::clamp(0.5F + (puddle(rest_mm) - blood_from_) / kEdge, 0.0F, 1.0F);
    out.albedo += covered * (Vector3f(0.10F, 0.008F, 0.008F) - out.albedo);
    out.gloss += covered * (0.6F - out.gloss);
  }
  out.gloss *= wet_;
  return out;
}

float CavityCoat::puddle(const Vector3f& rest_mm) const {
  return noise_.at(rest_mm / 27.0F + Vector3f(3, 21, 13)) + 0.3F * noise_.at(rest_mm / 9.0F + Vector3f(8, 1, 25));
}

Reflectance CavityCoat::bare(const Vector3f& p, unsigned geometry) const {
  if (geometry == kInstrumentGeometry) return {Vector3f(0.30F, 0.31F, 0.33F), 0.5F};
  const bool organ = geometry == kOrganGeometry;
  const float coarse = noise_.at(p / 19.0F);
  const float middle = noise_.at(p / 6.3F);
  const float fine = noise_.at(p / 1.9F);
  // About its mean, the organ's pattern is as much stronger as asked.
  const auto stronger = [&](float shade, float mean) {
    return organ ? std::max(0.05F, shade + (texture_ - 1) * (shade - mean)) : shade;
  };
  Reflectance out;
  if (coat_ == Coat::skin) {
    const float shade = organ ? 0.80F + 0.14F * coarse + 0.14F * middle + 0.12F * fine : 0.6F + 0.5F * middle;
    out.albedo = (organ ? Vector3f(0.58F, 0.37F, 0.27F) : Vector3f(0.05F, 0.16F, 0.20F)) * stronger(shade, 1.0F);
    out.gloss = organ ? 0.16F : 0.0F;
  } else if (organ) {
    const float shade = 0.62F + 0.40F * coarse + 0.26F * middle + 0.16F * fine;
    out.albedo = Vector3f(0.40F, 0.105F, 0.075F) * stronger(shade, 1.03F);
    // Fine capsular vessels: the thin set where a smooth scalar passes through its middle.
    const float line = 1.0F - std::min(1.0F, std::abs(noise_.at(p / 11.0F + Vector3f(9, 4, 2)) - 0.5F) / 0.022F);
    const float vein = std::min(2.0F, line * texture_);
    out.albedo = out.albedo.cwiseProduct(Vector3f(1 - 0.25F * vein, 1 - 0.45F * vein, 1 - 0.40F * vein));
    out.gloss = 0.55F;
  } else {
    const float shade = 0.55F + 0.5F * coarse + 0.3F * middle;
    out.albedo = Vector3f(0.62F, 0.36F, 0.26F) * shade;
    out.gloss = 0.1F;
  }
  return out;
}

}  // namespace birdseye::hw_sim
