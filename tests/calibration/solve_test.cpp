#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>

#include "calibration/base/units.hpp"
#include "calibration/solve/board.hpp"
#include "calibration/solve/hand_eye.hpp"
#include "calibration/solve/intrinsics.hpp"
#include "calibration/solve/point_fit.hpp"
#include "tests/support/data.hpp"
#include "tests/support/lens.hpp"

namespace birdseye::calibration {
namespace {

using Points = std::vector<Eigen::Vector3d>;

Points read_points(const std::filesystem::path& path) {
  std::ifstream in(path);
  Points points;
  Eigen::Vector3d p;
  while (in >> p.x() >> p.y() >> p.z()) points.push_back(p);
  return points;
}

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

TEST(Board, ReadsItsSpec) {
  const auto board = parse_board("chessboard:14x10:3mm");
  ASSERT_TRUE(board);
  EXPECT_EQ(board->columns, 14);
  EXPECT_EQ(board->rows, 10);
  EXPECT_EQ(board->square_mm, 3);
  EXPECT_EQ(board_points_mm(*board).size(), 140U);
  EXPECT_EQ(board_points_mm(*board)[15], Eigen::Vector3d(3, 3, 0));
  for (const char* wrong : {"chessboard", "chessboard:2x5:3mm", "chessboard:14x10:3", "chessboard:14x10:0mm",
                            "chessboard:14x10:3mm ", "chequers:14x10:3mm", "chessboard:14x10:nanmm"}) {
    EXPECT_FALSE(parse_board(wrong)) << wrong;
  }
}

/// A scope with its sensor 280 mm up the shaft, looking at a board from many sides.
struct Bench {
  BoardSpec board{11, 8, 6};
  CameraModel camera = testing::wide_lens();
  Transform<Camera, Sensor> camera_from_sensor{rotation_exp(Eigen::Vector3d(0.2, -1.5, 0.1)),
                                               Eigen::Vector3d(6, -14, -280)};
  Points points = board_points_mm(board);
  std::vector<BoardView> views;
  std::vector<Transform<Tracker, Sensor>> poses;
  std::vector<Transform<Camera, Marker>> camera_from_marker;

  Bench(int stations, double corner_px, double position_mm, double angle_deg, bool one_axis = false) {
    camera.k3 = 0;  // the solver's model has none
    std::mt19937 rng(5);
    std::normal_distribution<double> normal(0, 1);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const auto normal3 = [&] { return Eigen::Vector3d(normal(rng), normal(rng), normal(rng)); };
    const Transform<Tracker, Marker> tracker_from_marker(rotation_exp(Eigen::Vector3d(0.1, 0.1, 0.6)),
                                                         Eigen::Vector3d(330, -150, 140));
    while (static_cast<int>(views.size()) < stations) {
      const Eigen::Vector3d turn = one_axis ? Eigen::Vector3d(0, 0, uniform(rng))
                                            : Eigen::Vector3d(0.5 * uniform(rng), 0.5 * uniform(rng), uniform(rng));
      const Eigen::Matrix3d r = rotation_exp(turn);
      const Eigen::Vector3d centre(30, 21, 0);
      const Transform<Camera, Marker> pose(r,
                                           Eigen::Vector3d(Eigen::Vector3d(0, 0, 95 + 15 * uniform(rng)) - r * centre));
      BoardView view;
      for (const Eigen::Vector3d& p : points)
        view.corners_px.push_back(*project(camera, pose * p) + corner_px * Eigen::Vector2d(normal(rng), normal(rng)));
      const auto truth = tracker_from_marker * pose.inverse() * camera_from_sensor;
      views.push_back(view);
      camera_from_marker.push_back(pose);
      poses.emplace_back(Eigen::Matrix3d(truth.rotation() * rotation_exp(angle_deg * kRadPerDeg * normal3())),
                         Eigen::Vector3d(truth.translation() + position_mm * normal3()));
    }
  }
};

TEST(Intrinsics, RecoversTheLensFromItsViews) {
  const Bench bench(20, 0.05, 0, 0);
  const auto solved = solve_intrinsics(bench.points, bench.views, 768, 576);
  ASSERT_TRUE(solved) << solved.error().what;
  EXPECT_NEAR(solved->rms_px, 0.05 * std::sqrt(2.0), 0.01);
  EXPECT_NEAR(solved->camera.fx_px, bench.camera.fx_px, 1.0);
  EXPECT_NEAR(solved->camera.cy_px, bench.camera.cy_px, 0.5);
  EXPECT_NEAR(solved->camera.k1, bench.camera.k1, 0.005);
  EXPECT_FALSE(solve_intrinsics(bench.points, std::span(bench.views).first(2), 768, 576));
}

TEST(Intrinsics, WebcamPointsReachThePublishedError) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const auto folder = *data / "camera_chessboard_webcam";
  std::vector<BoardView> views;
  Points points;
  for (int i = 0; i < 12; ++i) {
    std::ifstream in(folder / ("calib.image_points." + std::to_string(i) + ".txt"));
    Eigen::Vector2d corner;
    BoardView view;
    while (in >> corner.x() >> corner.y()) view.corners_px.push_back(corner);
    views.push_back(view);
    points = read_points(folder / ("calib.object_points." + std::to_string(i) + ".txt"));
  }
  const auto solved = solve_intrinsics(points, views, 640, 480, Distortion::radial3_tangential2);
  ASSERT_TRUE(solved) << solved.error().what;
  EXPECT_LE(solved->rms_px, 1.41132);
  EXPECT_NEAR(solved->camera.fx_px, 608.671795, 0.05);
  EXPECT_NEAR(solved->camera.k1, -0.02191634, 1e-3);
}

TEST(HandEye, IsExactWithoutNoise) {
  const Bench bench(8, 0, 0, 0);
  const auto solved = solve_hand_eye(bench.points, bench.views, bench.poses, bench.camera_from_marker, bench.camera);
  ASSERT_TRUE(solved) << solved.error().what;
  EXPECT_LT((solved->camera_from_sensor.matrix() - bench.camera_from_sensor.matrix()).norm(), 1e-5);
  EXPECT_LT(solved->tracked_rms_px, 1e-4);
}

TEST(HandEye, AveragesTheTrackersNoise) {
  // 30 records of 0.5 mm and 0.1 deg, averaged at each station.
  const Bench bench(24, 0.05, 0.5 / std::sqrt(30.0), 0.1 / std::sqrt(30.0));
  const auto solved = solve_hand_eye(bench.points, bench.views, bench.poses, bench.camera_from_marker, bench.camera);
  ASSERT_TRUE(solved) << solved.error().what;
  // What counts is where a point 100 mm before the lens comes out.
  const Eigen::Vector3d target = bench.camera_from_sensor.inverse() * Eigen::Vector3d(0, 0, 100);
  EXPECT_LT((solved->camera_from_sensor * target - Eigen::Vector3d(0, 0, 100)).norm(), 0.25);
}

TEST(HandEye, RefusesViewsThatAreNotOfTheBoard) {
  Bench bench(8, 0, 0, 0);
  bench.views[3].corners_px.pop_back();
  const auto solved = solve_hand_eye(bench.points, bench.views, bench.poses, bench.camera_from_marker, bench.camera);
  ASSERT_FALSE(solved);
  EXPECT_EQ(solved.error().code, Errc::bad_value);
}

TEST(HandEye, RefusesTurnsAboutOneAxis) {
  const Bench bench(8, 0, 0, 0, true);
  const auto solved = solve_hand_eye(bench.points, bench.views, bench.poses, bench.camera_from_marker, bench.camera);
  ASSERT_FALSE(solved);
  EXPECT_EQ(solved.error().code, Errc::degenerate);
}

}  // namespace
}  // namespace birdseye::calibration
