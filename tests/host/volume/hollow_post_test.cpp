#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "host/volume/marker_finder.hpp"
#include "host/volume/marker_near.hpp"
#include "host/volume/post_finder.hpp"
#include "tests/support/drawn_posts.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::any_direction;
using birdseye::testing::any_post;
using birdseye::testing::between;
using birdseye::testing::drawn_head;
using birdseye::testing::DrawnCt;
using birdseye::testing::DrawnPost;
using birdseye::testing::posts_on;
using Eigen::Vector3d;

const Vector3d kPostSpacings[] = {{0.914, 0.914, 0.5}, {0.5, 0.5, 0.5}, {0.7, 0.7, 1}, {0.9, 0.9, 2}};

Eigen::Matrix3d turned(const Vector3d& by) {
  return Eigen::AngleAxisd(by.norm(), by.normalized()).toRotationMatrix();
}

TEST(HollowPosts, OfAHeadAreFoundAndItsCavitiesAreNot) {
  std::mt19937 rng(3);
  for (const Vector3d& spacing : kPostSpacings) {
    SCOPED_TRACE(::testing::Message() << spacing.transpose());
    DrawnCt head = drawn_head(spacing, turned({0.1, 0.05, -0.1}));
    const std::vector<DrawnPost> posts = posts_on(head, rng);
    head.finish(30, rng);
    const FoundMarkers found = find_markers(head.ct, {{MarkerKind::post, 10, 0, 0}, std::nullopt});
    EXPECT_EQ(found.markers.size(), posts.size());
    EXPECT_TRUE(found.doubtful.empty());
    EXPECT_GE(found.passed_over, 1);
    for (const DrawnPost& post : posts) {
      const auto off_mm = [&post](const MarkerFit& fit) { return (fit.centre_in_patient_mm - post.centre).norm(); };
      const auto nearest = std::min_element(found.markers.begin(), found.markers.end(),
                                            [&](const auto& a, const auto& b) { return off_mm(a) < off_mm(b); });
      ASSERT_NE(nearest, found.markers.end());
      EXPECT_LT(off_mm(*nearest), 0.25);
      EXPECT_LT(off_mm(*nearest), 1.5 * kSigmasOf95 * nearest->sigma_mm);
    }
  }
}

TEST(HollowPosts, TheStatedErrorHolds) {
  int seeds = 0;
  int within = 0;
  for (const auto top : {DrawnPost::Top::cone, DrawnPost::Top::flat, DrawnPost::Top::open}) {
    for (const Vector3d& spacing : kPostSpacings) {
      SCOPED_TRACE(::testing::Message() << static_cast<int>(top) << " in voxels of " << spacing.transpose());
      for (unsigned seed = 0; seed < 25; ++seed, ++seeds) {
        std::mt19937 rng(seed);
        DrawnCt scene(Vector3d(36, 36, 36), spacing, Eigen::Matrix3d::Identity(), -1000);
        const DrawnPost post = any_post(rng, top);
        post.draw(scene, between(rng, 0.35, 0.7));
        scene.finish(between(rng, 20, 40), rng);
        const auto fit = fit_hollow_post(scene.ct, post.centre + between(rng, 0, 2) * any_direction(rng), 12);
        ASSERT_TRUE(fit) << seed;
        const double off_mm = (fit->centre_in_patient_mm - post.centre).norm();
        EXPECT_LT(off_mm, 0.4) << seed;
        EXPECT_LT(fit->sigma_mm, 0.2) << seed;
        within += off_mm < kSigmasOf95 * fit->sigma_mm ? 1 : 0;
      }
    }
  }
  EXPECT_GE(within, 0.9 * seeds);
  EXPECT_LE(within, 0.99 * seeds);
}

TEST(HollowPosts, OpenOnesAreFoundUpToTheirRims) {
  for (const Vector3d& spacing : kPostSpacings) {
    SCOPED_TRACE(::testing::Message() << spacing.transpose());
    for (unsigned seed = 0; seed < 6; ++seed) {
      std::mt19937 rng(seed);
      DrawnCt scene(Vector3d(50, 50, 50), spacing, Eigen::Matrix3d::Identity(), -1000);
      const DrawnPost post = any_post(rng, DrawnPost::Top::open);
      post.draw(scene, 0.5);
      scene.finish(30, rng);
      const FoundMarkers found = find_hollow_posts(scene.ct, {10});
      ASSERT_EQ(found.markers.size(), 1U) << seed;
      EXPECT_LT((found.markers[0].centre_in_patient_mm - post.centre).norm(), 0.4) << seed;
    }
  }
}

TEST(HollowPosts, OneThatIsUnlikeTheOthersIsInDoubt) {
  std::mt19937 rng(8);
  DrawnCt scene(Vector3d(120, 120, 40), {0.914, 0.914, 0.5}, Eigen::Matrix3d::Identity(), -1000);
  for (int n = 0; n < 5; ++n) {
    DrawnPost post;
    post.centre = Vector3d(n % 3 * 35 - 35, n / 3 * 40 - 20, 0.3 * n);
    if (n == 4) post.radius = post.height = 2.6;
    post.draw(scene, 0.5);
  }
  scene.finish(30, rng);
  const FoundMarkers found = find_hollow_posts(scene.ct, {10});
  EXPECT_EQ(found.markers.size(), 4U);
  ASSERT_EQ(found.doubtful.size(), 1U);
  EXPECT_NE(found.doubtful[0].reason.find("unlike"), std::string::npos);
}

TEST(MarkersNear, ABallThatHangsTogetherWithBoneIsFound) {
  std::mt19937 rng(2);
  DrawnCt scene(Vector3d(60, 60, 60), {0.7, 0.7, 1}, Eigen::Matrix3d::Identity(), 40);
  const Vector3d ball(3.3, -2.1, 1.7);
  const auto outside_bone = [](const Vector3d& p) { return p.z() + 4; };
  scene.add({0, 0, -20}, 60, 0.5, 900, outside_bone);
  scene.add(ball, 4, 0.5, 2000, [&](const Vector3d& p) { return (p - ball).norm() - 4; });
  scene.add_turned({{0, 0}, {1, 0}, {1, -8}, {0, -8}}, ball - Vector3d(0, 0, 3), Vector3d::UnitZ(), 0.5, 900);
  scene.finish(30, rng);
  EXPECT_TRUE(find_markers(scene.ct, {{MarkerKind::ball, 8, 0, 0}, std::int16_t{300}}).markers.empty());
  for (const auto& shape : {std::optional<MarkerShape>(), std::optional<MarkerShape>({MarkerKind::ball, 8, 0, 0})}) {
    const auto fit = find_marker_near(scene.ct, ball + Vector3d(3, -3, 2), shape);
    ASSERT_TRUE(fit) << fit.error().what;
    EXPECT_EQ(fit->kind, MarkerKind::ball);
    EXPECT_NEAR(fit->diameter_mm, 8, 0.5);
    const double off_mm = (fit->centre_in_patient_mm - ball).norm();
    EXPECT_LT(off_mm, 0.25);
    EXPECT_LT(off_mm, 1.5 * kSigmasOf95 * fit->sigma_mm);
  }
}

TEST(MarkersNear, ARoughPickFindsThePostBesideIt) {
  std::mt19937 rng(5);
  DrawnCt head = drawn_head({0.914, 0.914, 0.5}, Eigen::Matrix3d::Identity());
  const std::vector<DrawnPost> posts = posts_on(head, rng);
  head.finish(30, rng);
  for (const DrawnPost& post : posts) {
    // People point at the tip.
    const Vector3d pick = post.centre + 6.3 * post.axis + 0.5 * any_direction(rng);
    const auto fit = find_marker_near(head.ct, pick);
    ASSERT_TRUE(fit) << fit.error().what;
    EXPECT_EQ(fit->kind, MarkerKind::post);
    EXPECT_LT((fit->centre_in_patient_mm - post.centre).norm(), 0.2);
  }
  // Cells, an ear canal, the brain, skin and air: none of them is a marker, nor is what is far away.
  for (const Vector3d& pick : {Vector3d(10, -53.5, 2), Vector3d(50, 10, -9), Vector3d(-20, 50, 30),
                               Vector3d(70, -70, 60), Vector3d(posts[0].centre + 16 * posts[0].axis)}) {
    const auto fit = find_marker_near(head.ct, pick);
    ASSERT_FALSE(fit) << pick.transpose() << " took " << fit->centre_in_patient_mm.transpose() << " kind "
                      << static_cast<int>(fit->kind) << " of " << fit->diameter_mm << " explained " << fit->explained;
    EXPECT_EQ(fit.error().code, Errc::not_found);
  }
  EXPECT_FALSE(find_marker_near(head.ct, {500, 0, 0}));
  EXPECT_FALSE(find_marker_near(head.ct, {NAN, 0, 0}));
}

}  // namespace
}  // namespace birdseye::host
