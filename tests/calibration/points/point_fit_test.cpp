#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>

#include "calibration/points/point_fit.hpp"
#include "tests/support/data.hpp"
#include "tests/support/points_file.hpp"

namespace birdseye::calibration {
namespace {

using testing::read_points;

using Points = std::vector<Eigen::Vector3d>;

TEST(PointFit, RecoversARigidMoveAndItsLeaveOneOutIsNotItsResidual) {
  const Points from{{0, 0, 0}, {100, 0, 0}, {0, 80, 0}, {20, 30, 60}, {-40, 10, 90}};
  const Transform<Patient, Tracker> truth(rotation_exp(Eigen::Vector3d(0.4, -1.1, 2)), Eigen::Vector3d(5, -300, 70));
  Points to;
  for (const Eigen::Vector3d& p : from) to.push_back(truth * p);
  auto fit = fit_points<Patient, Tracker>(to, from);
  ASSERT_TRUE(fit);
  EXPECT_LT((fit->to_from.matrix() - truth.matrix()).norm(), 1e-10);
  EXPECT_LT(fit->fre_rms_mm, 1e-10);
  to[2] += Eigen::Vector3d(0, 0, 3);
  fit = fit_points<Patient, Tracker>(to, from);
  EXPECT_NEAR(fit->leave_one_out_mm[2], 3, 1e-9);
  EXPECT_LT(fit->residuals_mm[2], 3);
}

TEST(PointFit, IsNeverAReflection) {
  const Points from{{0, 0, 0}, {100, 0, 0}, {0, 80, 0}, {0, 0, 60}};
  Points mirrored;
  for (const Eigen::Vector3d& p : from) mirrored.emplace_back(-p.x(), p.y(), p.z());
  const auto fit = fit_points<Patient, Tracker>(mirrored, from);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->to_from.rotation().determinant(), 1, 1e-12);
  EXPECT_GT(fit->fre_rms_mm, 10);
}

TEST(PointFit, RefusesWhatDoesNotDetermineAFit) {
  const Points line{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {5, 5, 5}};
  EXPECT_EQ((fit_points<Patient, Tracker>(line, line).error().code), Errc::degenerate);
  const Points two{{0, 0, 0}, {1, 0, 0}};
  EXPECT_EQ((fit_points<Patient, Tracker>(two, two).error().code), Errc::degenerate);
  const Points same{{1, 2, 3}, {1, 2, 3}, {1, 2, 3}};
  EXPECT_EQ((fit_points<Patient, Tracker>(same, same).error().code), Errc::degenerate);
  Points nan{{0, 0, 0}, {1, 0, 0}, {0, NAN, 0}};
  EXPECT_EQ((fit_points<Patient, Tracker>(nan, nan).error().code), Errc::bad_value);
  EXPECT_EQ((fit_points<Patient, Tracker>(two, line).error().code), Errc::bad_value);
}

TEST(PointFit, PelvisPhantomAsPublished) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const auto folder = *data / "fiducial_registration_pelvis_phantom";
  struct Case {
    const char *ct, *published;
    double fre_mm;
    std::vector<double> residuals_mm, leave_one_out_mm;
  };
  const Case cases[] = {
      {"pelvis_cropped_ct_fiducial_markers.txt",
       "Tracker_to_pelvis_cropped.txt",
       0.4284,
       {0.418, 0.408, 0.465, 0.420},
       {0.93, 1.00, 0.96, 1.11}},
      {"pelvis_nii_ct_fiducial_markers.txt", "Tracker_to_pelvis.txt", 0.6511, {0.579, 0.715, 0.746, 0.540}, {}}};
  for (const Case& c : cases) {
    const auto fit =
        fit_points<Patient, Tracker>(read_points(folder / c.ct), read_points(folder / "Tracker_Fiducial_Markers.txt"));
    ASSERT_TRUE(fit) << fit.error().what;
    EXPECT_NEAR(fit->fre_rms_mm, c.fre_mm, 5e-5);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(fit->residuals_mm[i], c.residuals_mm[i], 5e-4);
    for (std::size_t i = 0; i < c.leave_one_out_mm.size(); ++i)
      EXPECT_NEAR(fit->leave_one_out_mm[i], c.leave_one_out_mm[i], 5e-3);
    std::ifstream in(folder / c.published);
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column) {
        double published = 0;
        in >> published;
        EXPECT_NEAR(fit->to_from.matrix()(row, column), published, 1e-6);
      }
    }
  }
}

}  // namespace
}  // namespace birdseye::calibration
