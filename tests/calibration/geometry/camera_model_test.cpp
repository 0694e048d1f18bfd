#include "calibration/geometry/camera_model.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "calibration/geometry/transform.hpp"
#include "tests/support/data.hpp"
#include "tests/support/lens.hpp"
#include "tests/support/undistorted_by_opencv.hpp"

namespace birdseye {
namespace {

using testing::wide_lens;

double* parameter(CameraModel& c, int i) {
  double* const all[] = {&c.fx_px, &c.fy_px, &c.cx_px, &c.cy_px, &c.k1, &c.k2, &c.p1, &c.p2, &c.k3};
  return all[i];
}

TEST(CameraModel, UnprojectUndoesProjectOverTheWholePicture) {
  const CameraModel c = wide_lens();
  for (int y = 0; y < c.height_px; y += 23) {
    for (int x = 0; x < c.width_px; x += 23) {
      const auto ray = unproject(c, Eigen::Vector2d(x, y));
      ASSERT_TRUE(ray) << x << " " << y;
      EXPECT_LT((*project(c, *ray * 120) - Eigen::Vector2d(x, y)).norm(), 1e-9);
    }
  }
}

TEST(CameraModel, JacobiansAreWhatCentralDifferencesSay) {
  const CameraModel c = wide_lens();
  std::mt19937 rng(9);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Vector3d p(55 * uniform(rng), 40 * uniform(rng), 90 + 20 * uniform(rng));
    ProjectionJacobians j;
    const auto pixel = project(c, p, &j);
    ASSERT_TRUE(pixel);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = 1e-4 * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector2d numeric = (*project(c, p + step) - *project(c, p - step)) / 2e-4;
      EXPECT_LT((j.by_point.col(axis) - numeric).norm(), 1e-6);
    }
    for (int i = 0; i < CameraModel::kParameters; ++i) {
      CameraModel up = c, down = c;
      const double step = 1e-5 * std::max(1.0, std::abs(*parameter(up, i)));
      *parameter(up, i) += step;
      *parameter(down, i) -= step;
      const Eigen::Vector2d numeric = (*project(up, p) - *project(down, p)) / (2 * step);
      EXPECT_LT((j.by_parameter.col(i) - numeric).norm(), 1e-5 * std::max(1.0, numeric.norm())) << i;
    }
    Eigen::Matrix2d by_pixel;
    const auto ray = unproject(c, *pixel, &by_pixel);
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d step = 1e-3 * Eigen::Vector2d::Unit(axis);
      const Eigen::Vector3d numeric = (*unproject(c, *pixel + step) - *unproject(c, *pixel - step)) / 2e-3;
      EXPECT_LT((by_pixel.col(axis) - numeric.head<2>()).norm(), 1e-8);
    }
    EXPECT_LT((ray->head<2>() - p.head<2>() / p.z()).norm(), 1e-12);
  }
}

TEST(CameraModel, AgreesWithOpenCv) {
  const CameraModel c = wide_lens();
  const cv::Matx33d k(c.fx_px, 0, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1);
  const std::vector<double> d{c.k1, c.k2, c.p1, c.p2, c.k3};
  std::vector<cv::Point3d> points;
  for (int i = 0; i < 40; ++i) points.emplace_back(3 * i - 60, 45 - 2.2 * i, 80 + i);
  std::vector<cv::Point2d> expected;
  cv::projectPoints(points, cv::Vec3d::zeros(), cv::Vec3d::zeros(), k, d, expected);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto pixel = project(c, {points[i].x, points[i].y, points[i].z});
    EXPECT_LT((*pixel - Eigen::Vector2d(expected[i].x, expected[i].y)).norm(), 1e-9);
  }
}

TEST(CameraModel, GivesNoRayWhereTheLensFolds) {
  CameraModel c = wide_lens();
  c.k1 = -0.6;
  c.k2 = c.k3 = 0;
  EXPECT_FALSE(unproject(c, Eigen::Vector2d(c.cx_px + 900, c.cy_px)));
  EXPECT_FALSE(project(c, {1, 1, -5}));
  EXPECT_FALSE(project(c, {1, 1, 0}));
}

TEST(CameraModel, RefusesWhatIsNoCamera) {
  CameraModel c = wide_lens();
  c.width_px = 0;
  EXPECT_FALSE(check(c));
  c = wide_lens();
  c.fy_px = -1;
  EXPECT_FALSE(check(c));
  c = wide_lens();
  c.k2 = NAN;
  EXPECT_FALSE(check(c));
  for (double CameraModel::*const field : {&CameraModel::fx_px, &CameraModel::cy_px, &CameraModel::k3}) {
    c = wide_lens();
    c.*field = 1e38;
    EXPECT_FALSE(check(c));
  }
  c = wide_lens();
  c.fy_px = 1e-320;
  EXPECT_FALSE(check(c));
}

TEST(CameraModel, RefusesFocalLengthsAndACentreThatNoLensHas) {
  const auto error_of = [](double fx_px, double fy_px, double cx_px, double cy_px) {
    const auto checked = check(CameraModel{640, 480, fx_px, fy_px, cx_px, cy_px});
    return checked ? "" : checked.error().what;
  };
  EXPECT_EQ(error_of(600, 75, 322, 237), "") << "--pixel-aspect 1:8";
  EXPECT_EQ(error_of(600, 4800, 322, 237), "") << "--pixel-aspect 8";
  EXPECT_NE(error_of(600, 7, 322, 237).find("focal lengths 600, 7 px are more than 10 times apart"), std::string::npos);
  EXPECT_NE(error_of(7, 600, 322, 237).find("focal lengths 7, 600 px are more than 10 times apart"), std::string::npos);
  EXPECT_EQ(error_of(600, 600, -320, 720), "");
  for (const auto& [cx_px, cy_px] : {std::pair(-321.0, 237.0), {961.0, 237.0}, {322.0, -241.0}, {322.0, 721.0}})
    EXPECT_NE(error_of(600, 600, cx_px, cy_px).find("is far outside its picture of 640x480 px"), std::string::npos);
}

TEST(CameraModel, LiverSurfaceProjectsAsItsReadmeSays) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const auto folder = *data / "overlay_projection_reference";
  CameraModel c;
  c.width_px = 1920;
  c.height_px = 1080;
  double k[9];
  std::ifstream intrinsics(folder / "calib.left.intrinsics.txt");
  for (double& value : k) intrinsics >> value;
  c.fx_px = k[0];
  c.cx_px = k[2];
  c.fy_px = k[4];
  c.cy_px = k[5];
  Eigen::Matrix4d camera_from_model;
  std::ifstream pose(folder / "model_to_camera.txt");
  for (int i = 0; i < 16; ++i) pose >> camera_from_model(i / 4, i % 4);
  std::ifstream ply(folder / "liver_sub.ply");
  std::string line;
  int vertices = 0;
  while (std::getline(ply, line) && line.find("end_header") == std::string::npos) {
    if (line.rfind("element vertex", 0) == 0) vertices = std::stoi(line.substr(15));
  }
  ASSERT_EQ(vertices, 1252);
  const auto transform = Transform<Camera, Patient>::from_matrix(camera_from_model);
  Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (int i = 0; i < vertices && std::getline(ply, line); ++i) {
    Eigen::Vector3d p;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf %lf %lf", &p.x(), &p.y(), &p.z()), 3);
    const Eigen::Vector3d in_camera = transform * p;
    const auto pixel = project(c, in_camera);
    ASSERT_TRUE(pixel);
    low = low.cwiseMin(*pixel);
    high = high.cwiseMax(*pixel);
  }
  EXPECT_NEAR(low.x(), 118.421, 0.01);
  EXPECT_NEAR(high.x(), 3314.219, 0.01);
  EXPECT_NEAR(low.y(), 57.504, 0.01);
  EXPECT_NEAR(high.y(), 992.349, 0.01);
}

TEST(CameraModel, UndistortsAsOpenCvDid) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  for (const std::string side : {"left", "right"}) {
    const auto [c, picture, expected] = testing::undistorted_by_opencv(*data, side, cv::IMREAD_GRAYSCALE);
    ASSERT_FALSE(picture.empty() || expected.empty());
    // For each pixel of the straight picture, where the bent one has it; bilinear, black outside.
    double sum = 0;
    for (int y = 0; y < picture.rows; ++y) {
      for (int x = 0; x < picture.cols; ++x) {
        const auto at = project(c, {(x - c.cx_px) / c.fx_px, (y - c.cy_px) / c.fy_px, 1});
        double grey = 0;
        const int i = static_cast<int>(std::floor(at->x()));
        const int j = static_cast<int>(std::floor(at->y()));
        for (int corner = 0; corner < 4; ++corner) {
          const int a = i + (corner & 1), b = j + (corner >> 1);
          if (a < 0 || b < 0 || a >= picture.cols || b >= picture.rows) continue;
          grey += (1 - std::abs(at->x() - a)) * (1 - std::abs(at->y() - b)) * picture.at<std::uint8_t>(b, a);
        }
        sum += std::abs(std::round(grey) - expected.at<std::uint8_t>(y, x));
      }
    }
    EXPECT_LT(sum / (picture.rows * picture.cols), 0.15) << side;
  }
}

}  // namespace
}  // namespace birdseye
