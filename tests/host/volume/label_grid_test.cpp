#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "host/volume/import.hpp"
#include "host/volume/labels.hpp"
#include "hw-sim/phantom/dicom_series.hpp"
#include "hw-sim/phantom/grid.hpp"
#include "hw-sim/phantom/image_files.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::Scratch;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

const hw_sim::Grid kGrid{{6, 5, 4}, {10, -20, 30}, {0.5, 0.75, 2}};

TEST(LabelGrid, WhatLiesOutsideOfTheCtIsTold) {
  const Scratch scratch;
  std::vector<std::int16_t> hu(kGrid.voxels());
  std::iota(hu.begin(), hu.end(), std::int16_t{0});
  ASSERT_TRUE(hw_sim::write_dicom_series(scratch / "ct", kGrid, hu, 1));
  const auto ct = import_volume(scratch / "ct");
  ASSERT_TRUE(ct);
  const std::vector<std::uint8_t> labels(kGrid.voxels(), 3);
  const auto shifted_by = [&](int voxels) {
    hw_sim::Grid other = kGrid;
    other.origin_mm.z() += voxels * kGrid.spacing_mm.z();
    EXPECT_TRUE(hw_sim::write_labels(scratch / "shifted.nii.gz", other, labels));
    return import_named_labels(scratch / "shifted.nii.gz", *ct, {});
  };
  const auto whole = shifted_by(0), cut = shifted_by(1), elsewhere = shifted_by(kGrid.size[2] - 1);
  ASSERT_TRUE(whole && cut);
  EXPECT_THAT(whole->notes, Not(Contains(HasSubstr("outside"))));
  EXPECT_THAT(
      cut->notes,
      Contains(HasSubstr(fmt::format("shifted.nii.gz: {:.1f} % of its voxels that have a label lie outside of the CT",
                                     100.0 / kGrid.size[2]))));
  ASSERT_FALSE(elsewhere);
  EXPECT_THAT(elsewhere.error().what, HasSubstr("lie outside of the CT; is it of this CT?"));
}

}  // namespace
}  // namespace birdseye::host
