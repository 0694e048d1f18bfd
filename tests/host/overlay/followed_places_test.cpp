#include "host/overlay/followed_places.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "calibration/geometry/rotations.hpp"

namespace birdseye::host {
namespace {

using Vector = Eigen::Vector3d;
using Relative = Transform<Camera, Camera>;

constexpr double kWithin = 0.005;

/// What a picture adds to where a place lies, one sigma of each axis; of the places, so many were followed to anywhere.
struct Errors {
  double noise = 0.2 * kWithin;
  double wrong_share = 0;
};

/// Places of an uneven scene, 60 to 140 mm from the camera, before and after a motion of it.
std::vector<FollowedPlace> places_seen(std::size_t count, const Relative& now_from_then, const Errors& errors,
                                       std::uint64_t draw) {
  std::mt19937_64 random(draw);
  std::uniform_real_distribution<double> across(-0.4, 0.4), deep_mm(60, 140), any_rad(0, 2 * M_PI), wrong_by(0.02, 0.1);
  std::normal_distribution<double> noise(0, errors.noise);
  const auto right = static_cast<std::size_t>(std::lround(static_cast<double>(count) * (1 - errors.wrong_share)));
  std::vector<FollowedPlace> places;
  for (std::size_t i = 0; i < count; ++i) {
    const Vector then(across(random), across(random), 1);
    const Vector there = now_from_then * Vector(deep_mm(random) * then);
    Vector now = there / there.z();
    if (i >= right) {
      const double to_rad = any_rad(random), far = wrong_by(random);
      now += Vector(far * std::cos(to_rad), far * std::sin(to_rad), 0);
    } else if (errors.noise > 0) {
      now += Vector(noise(random), noise(random), 0);
    }
    places.push_back({then, now});
  }
  return places;
}

/// Of 60 draws of places, in how many they go as one.
int go_as_one_of_60(std::size_t count, const Relative& motion, const Errors& errors = {}) {
  int times = 0;
  for (std::uint64_t draw = 1; draw <= 60; ++draw)
    times += go_as_one(places_seen(count, motion, errors, draw), kWithin) ? 1 : 0;
  return times;
}

const Relative kMotion(rotation_exp(Vector(0.1, -0.2, 0.05)), Vector(20, -15, 5));

TEST(GoAsOne, PlacesOfARigidSceneDoWhicheverWayTheCameraMoves) {
  for (const Vector& turn_rad : {Vector(0.3, 0, 0), Vector(0, -0.3, 0), Vector(0, 0, 0.5), Vector(0.1, 0.1, -0.1)})
    for (const Vector& shift_mm : {Vector(30, 0, 0), Vector(0, -30, 0), Vector(0, 0, 20), Vector(10, 10, 10)})
      for (const std::size_t count : {15U, 40U})
        EXPECT_GE(go_as_one_of_60(count, Relative(rotation_exp(turn_rad), shift_mm)), 57)
            << count << "; " << turn_rad.transpose() << "; " << shift_mm.transpose();
}

TEST(GoAsOne, PlacesDoBeforeACameraThatOnlyTurnsOrRests) {
  for (const Vector& turn_rad : {Vector(0.1, -0.2, 0.05), Vector(0, 0, 0)})
    for (const std::size_t count : {15U, 30U, 60U})
      EXPECT_GE(go_as_one_of_60(count, Relative(rotation_exp(turn_rad), Vector::Zero())), 57) << count;
}

/// The fewer there are, the less it takes to hide it: then it is not told.
TEST(GoAsOne, WhereSomeWereFollowedWronglyEnoughPlacesTell) {
  EXPECT_GE(go_as_one_of_60(30, kMotion, {.wrong_share = 0.2}), 50);
  EXPECT_GE(go_as_one_of_60(60, kMotion, {.wrong_share = 0.3}), 50);
  EXPECT_LT(go_as_one_of_60(15, kMotion, {.wrong_share = 0.3}), 30);
}

TEST(GoAsOne, WhereMostWereFollowedWronglyNoMotionHasThem) {
  for (const std::size_t count : {15U, 20U, 40U, 80U})
    EXPECT_LE(go_as_one_of_60(count, kMotion, {.wrong_share = 0.6}), 3) << count;
}

TEST(GoAsOne, AsManyPlacesAsAMotionIsFittedToTellNothing) {
  EXPECT_FALSE(go_as_one(places_seen(5, kMotion, {}, 1), kWithin));
  EXPECT_FALSE(go_as_one({}, kWithin));
}

TEST(GoAsOne, ThePosesMayBeWrong) {
  const auto places = places_seen(40, kMotion, {}, 1);
  const Relative turned(rotation_exp(Vector(0, 0, 0.3)), Vector::Zero());
  const auto off = median_off_line(places, turned * kMotion * turned.inverse());
  ASSERT_TRUE(off);
  EXPECT_GT(*off, 2 * kWithin);
  EXPECT_TRUE(go_as_one(places, kWithin));
}

TEST(MedianOffLine, IsNothingWhereThePosesAreRight) {
  const auto off = median_off_line(places_seen(40, kMotion, {.noise = 0}, 1), kMotion);
  ASSERT_TRUE(off);
  EXPECT_LT(*off, 1e-9);
}

TEST(MedianOffLine, IsEmptyWhereMostPlacesWouldBeBehindTheCamera) {
  EXPECT_FALSE(
      median_off_line(places_seen(40, kMotion, {}, 1), Relative(rotation_exp(Vector(0, M_PI, 0)), Vector::Zero())));
}

wire::VideoFrame video_of(const std::function<std::uint8_t(int, int)>& grey_at) {
  wire::VideoFrame frame;
  frame.width_px = 160;
  frame.height_px = 120;
  auto rgb = std::make_shared<std::vector<std::uint8_t>>();
  for (int y = 0; y < frame.height_px; ++y)
    for (int x = 0; x < frame.width_px; ++x) rgb->insert(rgb->end(), 3, grey_at(x, y));
  frame.rgb = rgb;
  return frame;
}

TEST(FollowPlaces, FindsNoneWhereThereIsNoSignalAndNoneFromThere) {
  const auto blobs = [](int x, int y) {
    return static_cast<std::uint8_t>(std::lround(120 + 60 * std::sin(0.31 * x + 0.002 * y * y) * std::cos(0.27 * y)));
  };
  const PictureToFollow seen = picture_to_follow(video_of(blobs));
  const PictureToFollow none = picture_to_follow(video_of([](int, int) { return std::uint8_t{16}; }));
  const auto places = places_to_follow(seen.grey);
  ASSERT_GT(places.size(), 20U);
  EXPECT_TRUE(places_to_follow(none.grey).empty());
  const auto found = [&](const PictureToFollow& from, const PictureToFollow& to) {
    return std::ranges::count_if(follow_places(from, to, places), [](const auto& place) { return place.has_value(); });
  };
  EXPECT_EQ(found(seen, seen), std::ssize(places));
  EXPECT_EQ(found(seen, none), 0);
  EXPECT_EQ(found(none, seen), 0);
  EXPECT_EQ(found(none, none), 0);
}

}  // namespace
}  // namespace birdseye::host
