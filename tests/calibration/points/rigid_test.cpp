#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "calibration/points/odd_points.hpp"
#include "calibration/points/point_error.hpp"
#include "calibration/points/point_fit.hpp"

namespace birdseye::calibration {
namespace {

using Points = std::vector<Eigen::Vector3d>;

const Transform<Patient, Tracker> kTruth(rotation_exp(Eigen::Vector3d(0.4, -1.1, 2)), Eigen::Vector3d(5, -300, 70));
/// Skin markers over a liver.
const Points kMarkers{{-152, -50, 40}, {-78, -101, 106}, {-15, -113, 132}, {70, -105, 86},
                      {-99, -95, -38}, {34, -114, -56},  {120, -60, 20},   {-130, -20, -60}};

/// The points as touched, with an error of this length (root mean square) in any direction.
class Touches {
 public:
  explicit Touches(unsigned seed) : rng_(seed) {}
  Points of(const Points& points, double localisation_rms_mm) {
    Points out;
    for (const Eigen::Vector3d& p : points)
      out.push_back(kTruth * p + localisation_rms_mm / std::sqrt(3.0) * normal3());
    return out;
  }
  Eigen::Vector3d normal3() { return {normal_(rng_), normal_(rng_), normal_(rng_)}; }
  Eigen::Vector3d direction() { return normal3().normalized(); }
  std::size_t below(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(rng_); }

 private:
  std::mt19937 rng_;
  std::normal_distribution<double> normal_{0, 1};
};

TEST(Tails, AreThoseOfTheTables) {
  EXPECT_NEAR(f_tail(4.7571, 3, 6), 0.05, 1e-5);  // tables of the F distribution
  EXPECT_NEAR(f_tail(23.7033, 3, 6), 0.001, 1e-6);
  EXPECT_NEAR(f_tail(1, 5, 5), 0.5, 1e-9);
  EXPECT_NEAR(chi_square_tail(7.8147, 3), 0.05, 1e-5);
  EXPECT_NEAR(chi_square_tail(12.5916, 6), 0.05, 1e-5);
}

TEST(TargetError, IsWhatManyRegistrationsShow) {
  const Points targets{{-20, -40, 30}, {60, 60, -40}, {-200, 50, 200}};
  constexpr double kLocalisation_mm = 1.5;
  constexpr int kTrials = 4000;
  Touches touches(3);
  for (const std::size_t n : {3U, 4U, 6U, 8U}) {
    const Points from(kMarkers.begin(), kMarkers.begin() + static_cast<std::ptrdiff_t>(n));
    Points expected;
    for (const Eigen::Vector3d& p : from) expected.push_back(kTruth * p);
    const TargetError predicted(expected, kLocalisation_mm);
    std::vector<double> squares(targets.size(), 0);
    double fre2 = 0;
    double fle2 = 0;
    int under_bound = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const auto fit = fit_points<Patient, Tracker>(touches.of(from, kLocalisation_mm), from);
      ASSERT_TRUE(fit);
      for (std::size_t t = 0; t < targets.size(); ++t)
        squares[t] += (fit->to_from * targets[t] - kTruth * targets[t]).squaredNorm() / kTrials;
      const LocalisationError fle = localisation_error_of(fit->fre_rms_mm, n);
      fre2 += fit->fre_rms_mm * fit->fre_rms_mm / kTrials;
      fle2 += fle.rms_mm * fle.rms_mm / kTrials;
      under_bound += fle.upper95_mm > kLocalisation_mm ? 1 : 0;
    }
    // 4000 trials of at least three degrees of freedom: 1.8 % of a square, one sigma; four of those.
    EXPECT_NEAR(fle2 / (kLocalisation_mm * kLocalisation_mm), 1, 0.052) << n;
    EXPECT_NEAR(fre2, kLocalisation_mm * kLocalisation_mm * (1 - 2.0 / static_cast<double>(n)), 0.05 * fre2 + 0.01)
        << n;
    EXPECT_NEAR(under_bound / static_cast<double>(kTrials), 0.95, 0.014) << n;
    for (std::size_t t = 0; t < targets.size(); ++t) {
      EXPECT_NEAR(std::sqrt(squares[t]) / predicted.rms_mm(kTruth * targets[t]), 1, 0.04)
          << n << " points, target " << t;
    }
  }
}

TEST(TargetError, IsLeastAtTheCentroidAndBlindToTheFrame) {
  const TargetError here(kMarkers, 1);
  EXPECT_NEAR(here.rms_mm(here.centroid_mm()), 1 / std::sqrt(8.0), 1e-12);
  Points there;
  for (const Eigen::Vector3d& p : kMarkers) there.push_back(kTruth * p);
  const Eigen::Vector3d target(30, 20, -10);
  EXPECT_NEAR(TargetError(there, 1).rms_mm(kTruth * target), here.rms_mm(target), 1e-9);
  EXPECT_NEAR(TargetError(kMarkers, 2).rms_mm(target), 2 * here.rms_mm(target), 1e-12);
}

/// How often sound sets are accused, and blunders of 10 mm found and put on the right point.
struct Rates {
  double accused = 0, noticed = 0, named = 0, misnamed = 0;
};
Rates rates(std::size_t n, double localisation_mm, std::optional<double> given_mm) {
  constexpr int kTrials = 2000;
  Touches touches(static_cast<unsigned>(n) + static_cast<unsigned>(100 * localisation_mm));
  Rates out;
  const Points from(kMarkers.begin(), kMarkers.begin() + static_cast<std::ptrdiff_t>(n));
  for (int trial = 0; trial < kTrials; ++trial) {
    Points to = touches.of(from, localisation_mm);
    if (find_odd_points(to, from, given_mm).verdict != OddPointsVerdict::none) out.accused += 1.0 / kTrials;
    const std::size_t wrong = touches.below(n);
    to[wrong] += 10 * touches.direction();
    const OddPoints odd = find_odd_points(to, from, given_mm);
    if (odd.verdict != OddPointsVerdict::none) out.noticed += 1.0 / kTrials;
    if (odd.named.size() == 1 && odd.named[0].index == wrong) out.named += 1.0 / kTrials;
    if (!odd.named.empty() && odd.named[0].index != wrong) out.misnamed += 1.0 / kTrials;
  }
  return out;
}

TEST(OddPoints, ASoundSetIsNotAccusedAndABlunderIsFound) {
  for (const double fle_mm : {0.5, 1.0}) {
    for (const std::size_t n : {5U, 6U, 8U}) {
      for (const bool given : {false, true}) {
        const Rates r = rates(n, fle_mm, given ? std::optional(fle_mm) : std::nullopt);
        SCOPED_TRACE(::testing::Message() << n << " points, " << fle_mm << " mm, " << (given ? "given" : "estimated"));
        EXPECT_LE(r.accused, 0.01 + 0.0067);  // 1 %, and three sigma of 2000 trials
        // Five points leave six degrees of freedom to estimate 1 mm from: then 10 mm are not always beyond chance.
        const bool hard = n == 5 && fle_mm == 1.0 && !given;
        EXPECT_GE(r.noticed, hard ? 0.95 : 0.995);
        EXPECT_GE(r.named, hard ? 0.94 : 0.99);
        EXPECT_LE(r.misnamed, 0.005);
      }
    }
  }
}

TEST(OddPoints, TwoBlundersDoNotHideEachOther) {
  Touches touches(17);
  int named = 0;
  constexpr int kTrials = 300;
  for (int trial = 0; trial < kTrials; ++trial) {
    Points to = touches.of(kMarkers, 0.7);
    to[2] += 10 * touches.direction();
    to[5] += 10 * touches.direction();
    const OddPoints odd = find_odd_points(to, kMarkers);
    named += odd.named.size() == 2 && odd.named[0].index == 2 && odd.named[1].index == 5 ? 1 : 0;
  }
  EXPECT_GE(named, 0.97 * kTrials);
}

TEST(OddPoints, SaysWhyAndByHowMuch) {
  Points to;
  for (const Eigen::Vector3d& p : kMarkers) to.push_back(kTruth * p);
  EXPECT_EQ(find_odd_points(to, kMarkers).verdict, OddPointsVerdict::none);
  to[3] += Eigen::Vector3d(0, 12, 0);
  const OddPoints odd = find_odd_points(to, kMarkers);
  ASSERT_EQ(odd.named.size(), 1U);
  EXPECT_EQ(odd.named[0].index, 3U);
  EXPECT_NEAR(odd.named[0].off_mm, 12, 1e-9);
  EXPECT_NE(odd.named[0].reason.find("12.0 mm from where the others put it"), std::string::npos);
  EXPECT_EQ(odd.told, "fiducial 4 is wrong: touch it again");
}

TEST(OddPoints, AmongFourNoneCanBeTold) {
  for (const std::size_t n : {3U, 4U}) {
    const Points from(kMarkers.begin(), kMarkers.begin() + static_cast<std::ptrdiff_t>(n));
    Points to = Touches(1).of(from, 0.3);
    to[1] += Eigen::Vector3d(0, 0, 10);
    const OddPoints odd = find_odd_points(to, from);
    EXPECT_EQ(odd.verdict, OddPointsVerdict::cannot_tell);
    EXPECT_TRUE(odd.named.empty());
    EXPECT_NE(odd.told.find("cannot be told"), std::string::npos);
  }
}

TEST(OddPoints, OfTwoThatMayBothBeToBlameItNamesBoth) {
  // Four near one another and one far away: a wrong point turns the rest, and leaving out another mends it as well.
  const Points from{{0, 0, 0}, {30, 0, 0}, {0, 30, 0}, {200, 200, 0}, {230, 180, 0}};
  Points to;
  Touches touches(4);
  int suspected = 0;
  for (int trial = 0; trial < 200; ++trial) {
    to = touches.of(from, 0.3);
    to[3] += Eigen::Vector3d(0, 0, 8);
    const OddPoints odd = find_odd_points(to, from);
    if (odd.verdict == OddPointsVerdict::suspected) {
      ++suspected;
      EXPECT_NE(std::find(odd.suspects.begin(), odd.suspects.end(), 3U), odd.suspects.end());
      EXPECT_NE(odd.told.find("cannot be told which"), std::string::npos);
    }
    for (const OddPoint& point : odd.named) EXPECT_EQ(point.index, 3U);
  }
  EXPECT_GT(suspected, 5);
}

}  // namespace
}  // namespace birdseye::calibration
