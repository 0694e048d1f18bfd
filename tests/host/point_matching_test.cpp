#include "host/registration/point_matching.hpp"

#include <gtest/gtest.h>

namespace birdseye::host {
namespace {

using Points = std::vector<Eigen::Vector3d>;
const Points kMarkers{{-152, -50, 40}, {-78, -101, 106}, {-15, -113, 132},
                      {70, -105, 86},  {-99, -95, -38},  {34, -114, -56}};
const Transform<Tracker, Patient> kTruth(rotation_exp(Eigen::Vector3d(0.3, -2, 1)), Eigen::Vector3d(300, 20, -40));

TEST(PointMatching, FindsWhichIsWhich) {
  const std::size_t order[] = {3, 0, 5, 1, 4, 2};
  Points touched;
  for (const std::size_t i : order) touched.push_back(kTruth * kMarkers[i] + Eigen::Vector3d(0.1, -0.2, 0.1));
  const auto matched = match_and_fit(kMarkers, touched);
  ASSERT_TRUE(matched) << matched.error().what;
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(matched->ct_of_touch[i], order[i]);
  EXPECT_LT((matched->fit.to_from.inverse() * Eigen::Vector3d(-50, 0, 0) - kTruth * Eigen::Vector3d(-50, 0, 0)).norm(),
            0.4);
}

TEST(PointMatching, RefusesMarkersThatCannotBeToldApart) {
  const Points square{{0, 0, 0}, {100, 0, 0}, {100, 100, 0}, {0, 100, 0}};
  const auto matched = match_and_fit(square, square);
  ASSERT_FALSE(matched);
  EXPECT_EQ(matched.error().code, Errc::degenerate);
}

TEST(PointMatching, RefusesAMissingTouch) {
  const auto matched = match_and_fit(kMarkers, std::span(kMarkers).first(5));
  ASSERT_FALSE(matched);
  EXPECT_NE(matched.error().what.find("6 markers found in the CT, 5 touched"), std::string::npos);
}

}  // namespace
}  // namespace birdseye::host
