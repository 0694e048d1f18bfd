#include "host/overlay/followed_places.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "calibration/geometry/rotations.hpp"

namespace birdseye::host {
namespace {

using Vector = Eigen::Vector3d;
using Relative = Transform<Camera, Camera>;

constexpr double kWithin = 0.005;

/// Places of an uneven scene, 60 to 140 mm from the camera, before and after a motion of it. The last so many were
/// followed to anywhere within so far of where they are.
std::vector<FollowedPlace> places_seen(std::size_t count, const Relative& now_from_then, std::size_t wrong = 0,
                                       double wrong_by = 0.1) {
  std::mt19937_64 random(count + 1000 * wrong);
  std::uniform_real_distribution<double> across(-0.4, 0.4), deep_mm(60, 140), any_rad(0, 2 * M_PI), share(0.2, 1);
  std::vector<FollowedPlace> places;
  for (std::size_t i = 0; i < count; ++i) {
    const Vector then(across(random), across(random), 1);
    const Vector there = now_from_then * Vector(deep_mm(random) * then);
    Vector now = there / there.z();
    if (i + wrong >= count) {
      const double to_rad = any_rad(random), far = wrong_by * share(random);
      now += Vector(far * std::cos(to_rad), far * std::sin(to_rad), 0);
    }
    places.push_back({then, now});
  }
  return places;
}

const Relative kMotion(rotation_exp(Vector(0.1, -0.2, 0.05)), Vector(20, -15, 5));

TEST(GoAsOne, PlacesOfARigidSceneDoWhicheverWayTheCameraMoves) {
  for (const Vector& turn_rad : {Vector(0.3, 0, 0), Vector(0, -0.3, 0), Vector(0, 0, 0.5), Vector(0.1, 0.1, -0.1)})
    for (const Vector& shift_mm : {Vector(30, 0, 0), Vector(0, -30, 0), Vector(0, 0, 20), Vector(10, 10, 10)})
      EXPECT_TRUE(go_as_one(places_seen(40, Relative(rotation_exp(turn_rad), shift_mm)), kWithin))
          << turn_rad.transpose() << "; " << shift_mm.transpose();
}

TEST(GoAsOne, PlacesOfARigidSceneDoBeforeACameraThatOnlyTurns) {
  EXPECT_TRUE(go_as_one(places_seen(40, Relative(rotation_exp(Vector(0.1, -0.2, 0.05)), Vector::Zero())), kWithin));
}

TEST(GoAsOne, AFewThatWereFollowedWronglyDoNotHideIt) {
  for (const std::size_t count : {20U, 40U, 80U})
    EXPECT_TRUE(go_as_one(places_seen(count, kMotion, count / 8), kWithin)) << count;
}

TEST(GoAsOne, WhereMostWereFollowedWronglyNoMotionHasThem) {
  for (const std::size_t count : {15U, 20U, 40U, 80U})
    EXPECT_FALSE(go_as_one(places_seen(count, kMotion, count * 3 / 5), kWithin)) << count;
}

TEST(GoAsOne, AsManyPlacesAsAMotionIsFittedToTellNothing) {
  EXPECT_FALSE(go_as_one(places_seen(5, kMotion), kWithin));
  EXPECT_FALSE(go_as_one({}, kWithin));
}

TEST(GoAsOne, ThePosesMayBeWrong) {
  const auto places = places_seen(40, kMotion);
  const Relative turned(rotation_exp(Vector(0, 0, 0.3)), Vector::Zero());
  const auto off = median_off_line(places, turned * kMotion * turned.inverse());
  ASSERT_TRUE(off);
  EXPECT_GT(*off, 2 * kWithin);
  EXPECT_TRUE(go_as_one(places, kWithin));
}

TEST(MedianOffLine, IsNothingWhereThePosesAreRight) {
  const auto off = median_off_line(places_seen(40, kMotion), kMotion);
  ASSERT_TRUE(off);
  EXPECT_LT(*off, 1e-9);
}

TEST(MedianOffLine, IsEmptyWhereMostPlacesWouldBeBehindTheCamera) {
  EXPECT_FALSE(median_off_line(places_seen(40, kMotion), Relative(rotation_exp(Vector(0, M_PI, 0)), Vector::Zero())));
}

}  // namespace
}  // namespace birdseye::host
