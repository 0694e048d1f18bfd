#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "calibration/base/result.hpp"
#include "hw-sim/case/deformation.hpp"
#include "hw-sim/case/pose_error.hpp"

namespace birdseye::hw_sim {

struct CaseSettings {
  std::filesystem::path folder;
  std::uint64_t seed = 1;
  std::string phantom = "liver";  ///< or head
  std::filesystem::path ct;       ///< a CT of a liver in place of the phantom
  std::filesystem::path labels;   ///< its organ labels, or empty to find the liver
  int liver_label = 5;
  int views = 5;
  int width_px = 768, height_px = 576;
  DeformationSettings deformation;
  double distance_mm = 0;     ///< from the organ's surface to the lens, about; 0: as suits the organ
  double noise = 1;           ///< of the sensor, as a multiple of the usual
  double lamp_offset_mm = 0;  ///< of the lamp to the right of the lens
  bool plain_background = false;
  double texture = 1, wet = 1;  ///< contrast of the organ's pattern and highlights, as multiples of the usual
  double blood = 0;             ///< share of the organ's surface that blood covers
  int instruments = 0;          ///< how many stand before the organ
  double blur_px = 0;           ///< of the lens: a Gaussian's standard deviation
  PoseError pose_error;         ///< of the poses that the case states
  int touches = 0;              ///< places of the surface that no view sees, for the case to name
  double touch_noise_mm = 1;    ///< of theirs, an axis
};

/// Writes folder/case.toml and all that it names: a CT of an organ at rest, its segmentation, and what a laparoscope
/// sees of it once it is deformed, with the truth beside it (docs/manual/simulator.md). The same settings give the same
/// bytes.
Result<void> write_case(const CaseSettings& settings);

}  // namespace birdseye::hw_sim
