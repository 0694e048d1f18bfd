#include "host/registration/rigid/point_matching.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

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

TEST(PointMatching, LeavesOutWhatWasNotTouchedOrIsNoMarker) {
  // Six of the markers touched; twenty more things in the CT were taken for markers.
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> uniform(-150, 150);
  std::normal_distribution<double> normal(0, 0.5);
  for (int trial = 0; trial < 20; ++trial) {
    Points ct;
    for (int i = 0; i < 10; ++i) ct.emplace_back(uniform(rng), uniform(rng), uniform(rng));
    ct.insert(ct.end(), kMarkers.begin(), kMarkers.end());
    for (int i = 0; i < 10; ++i) ct.emplace_back(uniform(rng), uniform(rng), uniform(rng));
    Points touched;
    for (const std::size_t i : {4U, 2U, 0U, 5U, 1U, 3U})
      touched.push_back(kTruth * kMarkers[i] + Eigen::Vector3d(normal(rng), normal(rng), normal(rng)));
    const auto matched = match_and_fit(ct, touched);
    ASSERT_TRUE(matched) << matched.error().what;
    EXPECT_EQ(matched->ct_of_touch, (std::vector<std::size_t>{14, 12, 10, 15, 11, 13}));
    EXPECT_EQ(matched->fit.residuals_mm.size(), 6U);
  }
}

TEST(PointMatching, TellsTheMirroredOrderByItsFitNotByDistances) {
  // Equal distances in two orders that are mirror images: only one of them is a rigid move.
  const Points ct{{0, 0, 0}, {100, 0, 0}, {50, 60, 0}, {50, 20, 70}};
  Points touched;
  for (const Eigen::Vector3d& p : ct) touched.push_back(kTruth * p);
  const auto matched = match_and_fit(ct, touched);
  ASSERT_TRUE(matched) << matched.error().what;
  EXPECT_EQ(matched->ct_of_touch, (std::vector<std::size_t>{0, 1, 2, 3}));
}

TEST(PointMatching, IsQuickWithTwelveOfTwelve) {
  std::mt19937 rng(9);
  std::uniform_real_distribution<double> uniform(-150, 150);
  Points ct;
  for (int i = 0; i < 12; ++i) ct.emplace_back(uniform(rng), uniform(rng), uniform(rng));
  Points touched;
  for (const Eigen::Vector3d& p : ct) touched.push_back(kTruth * p);
  std::reverse(touched.begin(), touched.end());
  const auto matched = match_and_fit(ct, touched);  // 479 million orders
  ASSERT_TRUE(matched) << matched.error().what;
  EXPECT_LT(matched->fit.fre_rms_mm, 1e-9);
}

TEST(PointMatching, RefusesWhatDoesNotFitOneWayOnly) {
  const auto expect = [](const Points& ct, const Points& touched, Errc code, const char* words) {
    const auto matched = match_and_fit(ct, touched);
    ASSERT_FALSE(matched) << words;
    EXPECT_EQ(matched.error().code, code);
    EXPECT_NE(matched.error().what.find(words), std::string::npos) << matched.error().what;
  };
  const Points five(kMarkers.begin(), kMarkers.begin() + 5);
  expect(five, kMarkers, Errc::bad_value, "5 markers found in the CT, 6 touched");
  expect(kMarkers, {{0, 0, 0}, {1, 0, 0}}, Errc::degenerate, "at least three");
  expect(kMarkers, {{0, 0, 0}, {900, 0, 0}, {0, 900, 0}, {0, 0, 900}}, Errc::degenerate, "no choice of markers");
  // Two of the same triangle in the CT.
  expect({{0, 0, 0}, {90, 0, 0}, {0, 60, 0}, {0, 0, 200}, {90, 0, 200}, {0, 60, 200}},
         {{0, 0, 0}, {90, 0, 0}, {0, 60, 0}}, Errc::degenerate, "cannot be told apart");
}

TEST(PointMatching, OfAGivenOrderARivalIsToldWhereItFitsAsWellAndNotWhereResidualsTell) {
  // A prism with a triangle at either end, the one turned against the other: a third of a turn changes no distance, and
  // its mirror image does not fit.
  std::vector<Eigen::Vector3d> prism;
  for (const double end : {0.0, 0.5}) {
    for (int k = 0; k < 3; ++k) {
      const double angle = end + k * 2 * std::numbers::pi / 3;
      prism.emplace_back(80 * std::cos(angle), 80 * std::sin(angle), end == 0 ? -60 : 60);
    }
  }
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.4);
  std::vector<Eigen::Vector3d> touched = prism;
  for (Eigen::Vector3d& p : touched) p += Eigen::Vector3d(noise(random), noise(random), noise(random));
  const std::vector<Eigen::Vector3d> one_round{touched[1], touched[2], touched[0], touched[4], touched[5], touched[3]};
  EXPECT_TRUE(rival_order_fre_mm(prism, touched));
  EXPECT_TRUE(rival_order_fre_mm(prism, one_round)) << "it fits, and turns the patient by a third";
  // With one marker 12 mm further out the given order is the only one, and the other is told by its rival.
  prism[0] *= 1.12;
  std::vector<Eigen::Vector3d> told = touched;
  told[0] *= 1.12;
  EXPECT_FALSE(rival_order_fre_mm(prism, told));
}

}  // namespace
}  // namespace birdseye::host
