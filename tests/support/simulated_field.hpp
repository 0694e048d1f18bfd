#pragma once

#include <random>
#include <string>
#include <vector>

#include "calibration/field/field_fit.hpp"
#include "hw-sim/minibird/field_distortion.hpp"

/// Measurements in the simulator's bent field: a sum of Gaussian bumps, which none of the fitted families is.
namespace birdseye::testing {

inline const Eigen::Vector3d kVolumeLowMm(120, -240, -200), kVolumeHighMm(620, 240, 200);

/// As measured where the sensor truly is at `pose`; noise_mm: RMS in space, noise_deg: likewise.
inline Transform<Tracker, Sensor> measured(const hw_sim::FieldDistortion& field, const Transform<Tracker, Sensor>& pose,
                                           double noise_mm, double noise_deg, std::mt19937& rng) {
  std::normal_distribution<double> normal;
  const auto random = [&](double rms) {
    return Eigen::Vector3d(rms / std::sqrt(3) * Eigen::Vector3d(normal(rng), normal(rng), normal(rng)));
  };
  const hw_sim::BirdPose bent = field.apply({pose.rotation(), pose.translation()});
  return {Eigen::Matrix3d(rotation_exp(random(noise_deg * 0.0174533)) * bent.rotation),
          Eigen::Vector3d(bent.position_mm + random(noise_mm))};
}

struct GridSpec {
  int nx = 6, ny = 6, nz = 5;
  double noise_mm = 0.3, noise_deg = 0.1;
};

/// A board that stands somewhere, measured node by node over the volume; the sensor is held the same way.
inline std::vector<calibration::FieldSample> grid_samples(const hw_sim::FieldDistortion& field, const GridSpec& spec,
                                                          unsigned seed) {
  std::mt19937 rng(seed);
  const Transform<Marker, Tracker> board_from_tracker(rotation_exp({0.3, -0.8, 0.4}), Eigen::Vector3d(40, -90, 300));
  const Eigen::Matrix3d held = rotation_exp({0.2, 0.5, -0.1});
  std::vector<calibration::FieldSample> out;
  for (int i = 0; i < spec.nx * spec.ny * spec.nz; ++i) {
    const Eigen::Vector3d part(i % spec.nx / (spec.nx - 1.0), i / spec.nx % spec.ny / (spec.ny - 1.0),
                               i / spec.nx / spec.ny / (spec.nz - 1.0));
    const Eigen::Vector3d place = kVolumeLowMm + part.cwiseProduct(kVolumeHighMm - kVolumeLowMm);
    out.push_back({"node " + std::to_string(i + 1), board_from_tracker * place, Eigen::Matrix3d::Identity(),
                   measured(field, {held, place}, spec.noise_mm, spec.noise_deg, rng)});
  }
  return out;
}

/// Where corrected poses are against the truth, at places that no fit was shown: RMS mm after the best rigid fit of
/// all, which is what a map cannot know; how many of the places were mapped.
struct Truth {
  double before_mm = 0, after_mm = 0, worst_mm = 0, before_deg = 0, after_deg = 0, mapped = 0;
};
Truth against_truth(const calibration::FieldMap& map, const hw_sim::FieldDistortion& field, unsigned seed);

}  // namespace birdseye::testing
