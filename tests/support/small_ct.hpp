#pragma once

#include <gtest/gtest.h>

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

}  // namespace birdseye::testing
