// The patient of the demo: read as that of a live operation is.
#include <gtest/gtest.h>

#include "host/demo/demo_session.hpp"
#include "hw-sim/phantom/image_files.hpp"
#include "tests/support/small_ct.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::Scratch;

const std::vector<Eigen::Vector3d> kMarkers{{0, 0, 0}, {60, 5, 0}, {10, 70, 20}, {30, 20, 50}};
const Eigen::Vector3d kTumourMm(31, 34, 22);

/// As the simulated cart makes it: a CT with markers, and a liver of vessels and tumour in its segmentation.
void make_patient(const Scratch& scratch) {
  const hw_sim::Grid grid = birdseye::testing::write_ct_with_markers(scratch / "phantom" / "ct", kMarkers);
  std::vector<std::uint8_t> labels(grid.voxels(), 0);
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const double from_tumour_mm = (grid.point(i, j, k) - kTumourMm).norm();
        if (from_tumour_mm < 14) labels[grid.index(i, j, k)] = 1;
        if (from_tumour_mm < 10) labels[grid.index(i, j, k)] = k % 2 == 0 ? 2 : 3;
        if (from_tumour_mm < 6) labels[grid.index(i, j, k)] = 4;
      }
    }
  }
  ASSERT_TRUE(hw_sim::write_labels(scratch / "phantom" / "segmentation.nii.gz", grid, labels));
}

TEST(DemoPatient, IsThatOfALiveOperationWithItsBrightestMarkers) {
  const Scratch scratch;
  make_patient(scratch);
  const auto patient = read_with_fiducials(scratch.path(), static_cast<int>(kMarkers.size()));
  ASSERT_TRUE(patient) << patient.error().what;
  const auto live = read_patient(simulated_patient(scratch.path()));
  ASSERT_TRUE(live) << live.error().what;
  EXPECT_EQ(patient->ct_sha256, live->ct_sha256);
  EXPECT_EQ(patient->shown.hu, live->shown.hu);
  EXPECT_LT(patient->shown.hu.size(), patient->ct.hu.size()) << "vessels and tumour alone are shown";
  EXPECT_LT((target_in_patient_mm(*patient) - kTumourMm).norm(), 0.5);
  ASSERT_EQ(patient->fiducials_in_patient_mm->size(), kMarkers.size());
  for (const Eigen::Vector3d& found : *patient->fiducials_in_patient_mm) {
    double nearest_mm = 1e9;
    for (const Eigen::Vector3d& marker : kMarkers) nearest_mm = std::min(nearest_mm, (found - marker).norm());
    EXPECT_LT(nearest_mm, 0.5);
  }
  EXPECT_EQ(read_with_fiducials(scratch.path(), 3)->fiducials_in_patient_mm->size(), 3U);
}

TEST(DemoPatient, WithFewerMarkersThanThereAreFiducialsIsRefused) {
  const Scratch scratch;
  make_patient(scratch);
  const auto patient = read_with_fiducials(scratch.path(), 5);
  ASSERT_FALSE(patient);
  EXPECT_NE(patient.error().what.find("phantom/ct: 4 markers found where there are 5"), std::string::npos)
      << patient.error().what;
}

}  // namespace
}  // namespace birdseye::host
