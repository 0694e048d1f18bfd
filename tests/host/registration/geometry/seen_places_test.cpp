// What views tell of where a surface is, on a ball that has moved by a known shift and is drawn by its formula.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "calibration/geometry/rotations.hpp"
#include "host/registration/geometry/outlines.hpp"
#include "host/registration/geometry/pose_adjustment.hpp"
#include "host/registration/geometry/stereo.hpp"
#include "tests/support/ball.hpp"
#include "tests/support/drawn_ball.hpp"

namespace birdseye::host {
namespace {

constexpr double kMovedBall_mm = 40;
const Eigen::Vector3d kMoved_mm(3, -2, -4);

/// Of the ball as it lies now, a fifth of a right angle and more apart.
const std::vector<PinholeView>& views_of_moved_ball() {
  static const std::vector<PinholeView> views = [] {
    const testing::DrawnBall ball(kMoved_mm, kMovedBall_mm);
    std::vector<PinholeView> out;
    for (const Eigen::Vector3d& eye_mm : {Eigen::Vector3d(0, 0, -150), {55, 0, -140}, {-55, 10, -140}, {0, 55, -140}})
      out.push_back(ball.seen_from(eye_mm, {0, 0, 0}));
    return out;
  }();
  return views;
}

double off_mm(const SeenPoint& point) {
  return (point.place_mm - kMoved_mm).norm() - kMovedBall_mm;
}

double median_of(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

TEST(StereoPoints, LieWhereTheSurfaceIsThoughItIsThoughtToBeWhereItWas) {
  const SeenSurface rest(testing::ball(kMovedBall_mm));
  const auto points = stereo_points(views_of_moved_ball(), rest, {18, 12, 0.5});
  ASSERT_GT(points.size(), 300U);
  std::vector<double> off, in_sigmas;
  for (const SeenPoint& point : points) {
    off.push_back(std::abs(off_mm(point)));
    in_sigmas.push_back(std::abs(off_mm(point)) / point.sigma_mm);
    ASSERT_TRUE(point.from_camera);
    EXPECT_LT(point.from_camera->dot(point.place_mm - kMoved_mm), 0) << "the side that a camera sees";
  }
  EXPECT_LT(median_of(off), 0.15);
  // Half of a normal error lies within 0.67 of its deviation; a sigma may be careful, and not careless.
  EXPECT_LT(median_of(in_sigmas), 1.0);
  EXPECT_LT(std::count_if(off.begin(), off.end(), [](double mm) { return mm > 1; }),
            static_cast<std::ptrdiff_t>(points.size() / 50));
}

TEST(StereoPoints, AreNoneOfOneViewAndNoneWhereViewsShowAnotherOrgan) {
  const SeenSurface rest(testing::ball(kMovedBall_mm));
  const auto& views = views_of_moved_ball();
  EXPECT_TRUE(stereo_points({views.front()}, rest, {18, 12, 0.5}).empty());
  // A view that has the pose of another.
  const std::vector<PinholeView> right{views[1], views[3]},
      strange{views[1], moved(views[3], views[2].camera_from_patient)};
  EXPECT_LT(10 * stereo_points(strange, rest, {18, 12, 0.5}).size(), stereo_points(right, rest, {18, 12, 0.5}).size());
}

TEST(OutlinePoints, LieWhereTheOutlineIs) {
  const SeenSurface rest(testing::ball(kMovedBall_mm));
  const auto points = outline_points(views_of_moved_ball(), rest, 9);
  ASSERT_GT(points.size(), 100U);
  std::vector<double> off;
  for (const SeenPoint& point : points) {
    EXPECT_FALSE(point.from_camera) << "it faces nobody";
    off.push_back(std::abs(off_mm(point)));
  }
  EXPECT_LT(median_of(off), 0.5);
}

TEST(AdjustedPoses, BringBackViewsThatErrByTensOfPixelsByWhatTheyShow) {
  std::vector<PinholeView> given = views_of_moved_ball();
  const std::vector<PinholeView> truth = given;
  const std::vector<Eigen::Vector3d> shifts_mm{{3, -2, 1}, {-4, 1, 2}, {2, 3, -3}, {-1, -3, 2}},
      turns{{0.5, -0.4, 0.3}, {-0.3, 0.6, 0.2}, {0.4, 0.2, -0.6}, {-0.5, -0.3, 0.3}};
  for (std::size_t n = 0; n < given.size(); ++n) {
    const Eigen::Matrix3d rotation =
        rotation_exp(Eigen::Vector3d(std::numbers::pi / 180 * turns[n])) * truth[n].camera_from_patient.rotation();
    const Eigen::Vector3d eye_mm = truth[n].eye_in_patient_mm + shifts_mm[n];
    given[n] = moved(given[n], {rotation, Eigen::Vector3d(-rotation * eye_mm)});
  }
  const auto adjusted = adjusted_poses(given, SeenSurface(testing::ball(kMovedBall_mm)));
  ASSERT_TRUE(adjusted);
  // Where rays of the same place of the ball pass one another.
  const auto apart_mm = [&](const std::vector<Transform<Camera, Patient>>& poses) {
    double most_mm = 0;
    for (const Eigen::Vector3d& place : {Eigen::Vector3d(3, -2, -44), {13, 5, -41}, {-7, -12, -41}}) {
      for (std::size_t w = 1; w < truth.size(); ++w) {
        const auto ray_of = [&](std::size_t n) {
          const auto pixel = truth[n].project(place);
          return moved(truth[n], poses[n]).ray(pixel.x_px, pixel.y_px).normalized();
        };
        const Eigen::Vector3d eye = poses[0].inverse().translation(), other = poses[w].inverse().translation();
        most_mm = std::max(most_mm, std::abs(ray_of(0).cross(ray_of(w)).normalized().dot(other - eye)));
      }
    }
    return most_mm;
  };
  std::vector<Transform<Camera, Patient>> before;
  for (const PinholeView& view : given) before.push_back(view.camera_from_patient);
  EXPECT_GT(apart_mm(before), 3);
  EXPECT_LT(apart_mm(adjusted->poses.camera_from_patient), 0.2);
}

/// Sums over places are made in one order, however many cores there are.
TEST(SeenPlaces, AreTheSameByOneCoreAndByMany) {
  const SeenSurface rest(testing::ball(kMovedBall_mm));
  const auto places = [&](std::size_t cores) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, cores);
    auto out = stereo_points(views_of_moved_ball(), rest, {24, 12, 0.5});
    const auto outlines = outline_points(views_of_moved_ball(), rest, 9);
    out.insert(out.end(), outlines.begin(), outlines.end());
    return out;
  };
  const auto one = places(1), many = places(4);
  ASSERT_EQ(one.size(), many.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].place_mm, many[i].place_mm);
    EXPECT_EQ(one[i].sigma_mm, many[i].sigma_mm);
  }
}

}  // namespace
}  // namespace birdseye::host
