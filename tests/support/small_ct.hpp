#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "hw-sim/phantom/dicom_series.hpp"
#include "hw-sim/phantom/grid.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::testing {

/// A small CT with a bright ball in it, as a DICOM series.
inline std::string small_ct(const Scratch& scratch, double radius_mm = 12) {
  hw_sim::Grid grid;
  grid.size = {20, 20, 20};
  grid.spacing_mm = {2, 2, 2};
  grid.origin_mm = {-20, -20, -20};
  std::vector<std::int16_t> hu;
  for (int k = 0; k < 20; ++k) {
    for (int j = 0; j < 20; ++j) {
      for (int i = 0; i < 20; ++i) hu.push_back(grid.point(i, j, k).norm() < radius_mm ? 200 : -1000);
    }
  }
  EXPECT_TRUE(hw_sim::write_dicom_series(scratch / "ct", grid, hu, 1));
  return (scratch / "ct").string();
}

/// A CT of tissue from -20 to 94 mm along each axis, with a brighter ball in its corner, as a DICOM series.
inline std::string ct_of_tissue(const Scratch& scratch, double radius_mm = 30) {
  hw_sim::Grid grid;
  grid.size = {20, 20, 20};
  grid.spacing_mm = {6, 6, 6};
  grid.origin_mm = {-20, -20, -20};
  std::vector<std::int16_t> hu;
  for (int k = 0; k < 20; ++k) {
    for (int j = 0; j < 20; ++j) {
      for (int i = 0; i < 20; ++i) hu.push_back(grid.point(i, j, k).norm() < radius_mm ? 200 : -100);
    }
  }
  EXPECT_TRUE(hw_sim::write_dicom_series(scratch / "ct", grid, hu, 1));
  return (scratch / "ct").string();
}

/// Spherical markers at these places of soft tissue, as a DICOM series.
inline hw_sim::Grid write_ct_with_markers(const std::filesystem::path& folder,
                                          std::span<const Eigen::Vector3d> markers_in_patient_mm) {
  hw_sim::Grid grid;
  grid.size = {68, 75, 61};
  grid.spacing_mm = {1.5, 1.5, 1.5};
  grid.origin_mm = {-20, -20, -20};
  std::vector<std::int16_t> hu;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        double outside_mm = 100;
        for (const Eigen::Vector3d& marker : markers_in_patient_mm)
          outside_mm = std::min(outside_mm, (grid.point(i, j, k) - marker).norm() - 4);
        hu.push_back(static_cast<std::int16_t>(40 + 1500 * std::clamp(0.5 - outside_mm / 1.5, 0.0, 1.0)));
      }
    }
  }
  EXPECT_TRUE(hw_sim::write_dicom_series(folder, grid, hu, 1));
  return grid;
}

}  // namespace birdseye::testing
