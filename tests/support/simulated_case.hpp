#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <utility>

#include "host/case/registration_case.hpp"
#include "hw-sim/case/registration_case.hpp"

namespace birdseye::testing {

/// Three small views of a liver that moved by so much, in that folder, with the truth beside them.
inline host::RegistrationCase simulated_case(const std::filesystem::path& folder, double amplitude_mm) {
  hw_sim::CaseSettings settings;
  settings.folder = folder;
  settings.seed = 5;
  settings.views = 3;
  settings.width_px = 384;
  settings.height_px = 288;
  settings.deformation.kind = hw_sim::DeformationKind::bezier;
  settings.deformation.amplitude_mm = amplitude_mm;
  const auto written = hw_sim::write_case(settings);
  EXPECT_TRUE(written) << written.error().what;
  auto read = host::read_case(folder / "case.toml");
  EXPECT_TRUE(read) << read.error().what;
  return *std::move(read);
}

}  // namespace birdseye::testing
