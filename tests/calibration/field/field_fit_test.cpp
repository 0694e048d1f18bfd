#include "calibration/field/field_fit.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "calibration/base/units.hpp"
#include "calibration/points/point_fit.hpp"
#include "tests/support/simulated_field.hpp"

namespace birdseye::testing {

Truth against_truth(const calibration::FieldMap& map, const hw_sim::FieldDistortion& field, unsigned seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> part(0, 1);
  std::vector<Eigen::Vector3d> truth, bent, corrected;
  std::vector<Eigen::Matrix3d> turns_before, turns_after;
  Truth out;
  constexpr int kPlaces = 800;
  const Eigen::Matrix3d held = rotation_exp({0.2, 0.5, -0.1});
  for (int i = 0; i < kPlaces; ++i) {
    const Eigen::Vector3d place =
        kVolumeLowMm + Eigen::Vector3d(part(rng), part(rng), part(rng)).cwiseProduct(kVolumeHighMm - kVolumeLowMm);
    const auto seen = measured(field, {held, place}, 0, 0, rng);
    const auto answer = map.correct(seen);
    if (!answer) continue;
    truth.push_back(place);
    bent.push_back(seen.translation());
    corrected.push_back(answer->tracker_from_sensor.translation());
    turns_before.emplace_back(seen.rotation() * held.transpose());
    turns_after.emplace_back(answer->tracker_from_sensor.rotation() * held.transpose());
  }
  out.mapped = static_cast<double>(truth.size()) / kPlaces;
  const auto before = calibration::fit_points<Tracker, Marker>(bent, truth);
  const auto after = calibration::fit_points<Tracker, Marker>(corrected, truth);
  if (!before || !after) return out;
  out.before_mm = before->fre_rms_mm;
  out.after_mm = after->fre_rms_mm;
  for (const double r : after->residuals_mm) out.worst_mm = std::max(out.worst_mm, r);
  const auto spread_deg = [](const std::vector<Eigen::Matrix3d>& turns) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const auto& t : turns) mean += rotation_log(t) / static_cast<double>(turns.size());
    double squares = 0;
    for (const auto& t : turns) squares += (rotation_log(t) - mean).squaredNorm() / static_cast<double>(turns.size());
    return kDegPerRad * std::sqrt(squares);
  };
  out.before_deg = spread_deg(turns_before);
  out.after_deg = spread_deg(turns_after);
  return out;
}

}  // namespace birdseye::testing

namespace birdseye::calibration {
namespace {

using testing::against_truth;
using testing::grid_samples;
using testing::GridSpec;

std::size_t outliers(const FieldFit& fit) {
  return static_cast<std::size_t>(
      std::count_if(fit.residuals.begin(), fit.residuals.end(), [](const auto& r) { return r.outlier; }));
}

TEST(FieldFit, TenMillimetresComeDownToLessThanEightTenths) {
  for (const double noise_mm : {0.3, 1.0, 1.8}) {
    double squares = 0;
    constexpr unsigned kFields = 5;
    for (unsigned seed = 1; seed <= kFields; ++seed) {
      const hw_sim::FieldDistortion field(10, seed);
      GridSpec spec;
      spec.noise_mm = noise_mm;
      const auto fit = fit_field(grid_samples(field, spec, seed));
      ASSERT_TRUE(fit) << fit.error().what;
      const auto truth = against_truth(fit->map, field, seed + 50);
      EXPECT_GT(truth.before_mm, 1.5);
      EXPECT_LT(truth.after_mm, 0.8) << noise_mm << " mm of noise, field " << seed;
      EXPECT_LT(truth.after_deg, truth.before_deg / 2) << seed;
      EXPECT_GT(truth.mapped, 0.95);
      squares += truth.after_mm * truth.after_mm / kFields;
      EXPECT_LE(outliers(*fit), 1U);
      // What was held out carries the noise of the measurement; the truth does not.
      EXPECT_NEAR(fit->held_out_mm, std::hypot(truth.after_mm, noise_mm), 0.3 * fit->held_out_mm) << seed;
      EXPECT_EQ(verdict_of(*fit).grade, noise_mm < 0.9 ? Grade::pass : Grade::marginal) << verdict_of(*fit).reasons[0];
    }
    EXPECT_LT(std::sqrt(squares), noise_mm < 0.5 ? 0.3 : 0.65) << noise_mm;
  }
}

TEST(FieldFit, EveryFamilyTakesMostOfItAway) {
  const hw_sim::FieldDistortion field(10, 3);
  const auto samples = grid_samples(field, {}, 3);
  double best_mm = 1e9;
  for (const FieldBasis basis : {FieldBasis::polynomial, FieldBasis::bernstein, FieldBasis::rbf}) {
    const auto fit = fit_field(samples, {basis});
    ASSERT_TRUE(fit);
    EXPECT_EQ(fit->map.data().functions.basis, basis);
    EXPECT_LT(against_truth(fit->map, field, 3).after_mm, 0.8) << name_of(basis);
    best_mm = std::min(best_mm, fit->held_out_mm);
  }
  const auto free = fit_field(samples);
  EXPECT_LT(free->held_out_mm, 1.05 * best_mm);  // within 2 % the simpler one is taken
}

TEST(FieldFit, ItsSigmaIsWhatMeasurementsAreOffBy) {
  double squares = 0, predicted = 0, count = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const hw_sim::FieldDistortion field(10, seed);
    GridSpec spec;
    spec.noise_mm = 0.6;
    const auto fit = fit_field(grid_samples(field, spec, seed));
    ASSERT_TRUE(fit);
    // Other nodes: the same volume in other steps, with the board where it was.
    GridSpec other = spec;
    other.nx = 8;
    other.nz = 7;
    for (const FieldSample& s : grid_samples(field, other, seed + 90)) {
      const auto corrected = fit->map.correct(s.measured);
      if (!corrected) continue;
      const Eigen::Vector3d truth = *fit->tracker_from_board * s.true_mm;
      squares += (corrected->tracker_from_sensor.translation() - truth).squaredNorm();
      predicted += corrected->sigma_mm * corrected->sigma_mm;
      ++count;
    }
  }
  EXPECT_GT(count, 1500);
  EXPECT_NEAR(std::sqrt(squares / predicted), 1, 0.25);
}

TEST(FieldFit, NeitherOrderNorTheBoardsPlaceMatters) {
  const hw_sim::FieldDistortion field(10, 5);
  auto samples = grid_samples(field, {5, 5, 4, 0.3, 0.1}, 5);
  const auto fit = fit_field(samples, {FieldBasis::polynomial});
  const Transform<Marker, Marker> moved(rotation_exp({1, -2, 0.4}), Eigen::Vector3d(900, -5, 17));
  for (FieldSample& s : samples) {
    s.true_mm = moved * s.true_mm;
    s.true_rotation = moved.rotation() * *s.true_rotation;
  }
  std::reverse(samples.begin(), samples.end());
  const auto again = fit_field(samples, {FieldBasis::polynomial});
  ASSERT_TRUE(fit && again);
  const Eigen::Vector3d place(300, 50, -40);
  EXPECT_LT((*fit->map.correction_mm(place) - *again->map.correction_mm(place)).norm(), 1e-7);
  EXPECT_NEAR(fit->held_out_mm, again->held_out_mm, 1e-7);
  EXPECT_NEAR(*fit->held_out_deg, *again->held_out_deg, 1e-7);
}

TEST(FieldFit, BlundersAreNamedAndDoNotBendTheMap) {
  const hw_sim::FieldDistortion field(10, 6);
  auto samples = grid_samples(field, {}, 6);
  const std::size_t wrong[] = {0, 17, 90, 91, 150};  // a corner, and two beside each other
  for (const std::size_t i : wrong)
    samples[i].measured =
        Transform<Tracker, Sensor>(samples[i].measured.rotation(),
                                   Eigen::Vector3d(samples[i].measured.translation() + Eigen::Vector3d(20, -15, 9)));
  samples[40].true_mm *= 2;  // the wrong node's name
  const auto fit = fit_field(samples);
  ASSERT_TRUE(fit);
  for (const std::size_t i : wrong) EXPECT_TRUE(fit->residuals[i].outlier) << i;
  EXPECT_TRUE(fit->residuals[40].outlier);
  EXPECT_LE(outliers(*fit), 7U);
  EXPECT_LT(against_truth(fit->map, field, 6).after_mm, 0.4);
}

std::string all_reasons(const FieldFit& fit) {
  std::string all;
  for (const std::string& reason : verdict_of(fit).reasons) all += reason + "\n";
  return all;
}

TEST(FieldFit, MetalThatMovesNeighboursIsNoBlunderOfEach) {
  const hw_sim::FieldDistortion field(10, 6);
  auto samples = grid_samples(field, {}, 6);
  const Eigen::Vector3d middle = samples[6 * 6 * 2 + 6 * 2 + 2].measured.translation();
  std::size_t moved = 0;
  for (FieldSample& s : samples) {
    const Eigen::Vector3d place = s.measured.translation();
    const double by_mm = 20 * std::exp(-(place - middle).squaredNorm() / (100 * 100));
    moved += by_mm > 6 ? 1 : 0;
    s.measured =
        Transform<Tracker, Sensor>(s.measured.rotation(), Eigen::Vector3d(place + Eigen::Vector3d(by_mm, 0, 0)));
  }
  ASSERT_EQ(moved, 7U);
  const auto fit = fit_field(samples);
  ASSERT_TRUE(fit) << fit.error().what;
  ASSERT_GT(outliers(*fit), 1U) << "or the map follows the metal";
  EXPECT_EQ(verdict_of(*fit).grade, Grade::marginal) << all_reasons(*fit);
  EXPECT_NE(all_reasons(*fit).find("next to one another"), std::string::npos) << all_reasons(*fit);
  EXPECT_FALSE(fit->map.correct(Transform<Tracker, Sensor>(Eigen::Matrix3d::Identity(), middle)));
  EXPECT_LT(fit->mapped_part, 0.98);
  EXPECT_GT(fit->mapped_part, 0.7);
}

TEST(FieldFit, SingleOutliersAreNamedAndMappedOver) {
  auto samples = grid_samples(hw_sim::FieldDistortion(10, 6), {}, 6);
  for (const std::size_t i : {33U, 90U}) {
    samples[i].measured = Transform<Tracker, Sensor>(
        samples[i].measured.rotation(), Eigen::Vector3d(samples[i].measured.translation() + Eigen::Vector3d(25, 0, 0)));
  }
  const auto fit = fit_field(samples);
  ASSERT_TRUE(fit) << fit.error().what;
  EXPECT_EQ(verdict_of(*fit).grade, Grade::pass) << all_reasons(*fit);
  EXPECT_NE(all_reasons(*fit).find("2 of 180 measurements do not fit the rest: node "), std::string::npos)
      << all_reasons(*fit);
  for (const char* name : {"node 34 (", "node 91 ("})
    EXPECT_NE(all_reasons(*fit).find(name), std::string::npos) << all_reasons(*fit);
  EXPECT_TRUE(fit->map.correct(samples[90].measured));
}

TEST(FieldFit, AHoleInTheSamplesIsNotMapped) {
  const hw_sim::FieldDistortion field(10, 7);
  auto samples = grid_samples(field, {9, 9, 8, 0.3, 0.1}, 7);
  std::erase_if(samples, [](const FieldSample& s) {
    return s.measured.translation().x() > 370 && s.measured.translation().y() > 0;
  });
  // One far corner keeps the box whole.
  const auto all = grid_samples(field, {9, 9, 8, 0.3, 0.1}, 7);
  samples.push_back(all.back());
  const auto fit = fit_field(samples);
  ASSERT_TRUE(fit);
  EXPECT_FALSE(fit->map.sigma_mm({540, 150, 0}));
  EXPECT_NE(fit->map.why_not({540, 150, 0}).find("not mapped near"), std::string::npos);
  EXPECT_TRUE(fit->map.sigma_mm({200, 150, 0}));
  EXPECT_LT(fit->mapped_part, 0.95);
}

TEST(FieldFit, OrientationIsLeftAloneWhereItIsNotKnown) {
  const hw_sim::FieldDistortion field(10, 8);
  auto samples = grid_samples(field, {5, 5, 4, 0.3, 0.1}, 8);
  samples[3].true_rotation.reset();
  const auto fit = fit_field(samples);
  ASSERT_TRUE(fit);
  EXPECT_FALSE(fit->map.maps_orientation());
  EXPECT_FALSE(fit->held_out_deg);
  const auto corrected = fit->map.correct(samples[50].measured);
  ASSERT_TRUE(corrected);
  EXPECT_EQ(corrected->tracker_from_sensor.rotation(), samples[50].measured.rotation());
}

/// A field that bends ever more towards the corners, as beside a table of steel; noise of 0.1 mm. Where a corner's cell
/// is left out, a map of its neighbours is extrapolated and off by far more than the map of all.
std::vector<FieldSample> strong_corners(std::mt19937& rng, int nodes, double corner_mm) {
  std::normal_distribution<double> noise(0, 0.1 / std::sqrt(3));
  std::vector<FieldSample> out;
  const Eigen::Vector3d middle = (testing::kVolumeLowMm + testing::kVolumeHighMm) / 2;
  const Eigen::Vector3d half = (testing::kVolumeHighMm - testing::kVolumeLowMm) / 2;
  for (int i = 0; i < nodes * nodes * nodes; ++i) {
    const Eigen::Vector3d part(i % nodes, i / nodes % nodes, i / nodes / nodes);
    const Eigen::Vector3d at = 2 * part / (nodes - 1) - Eigen::Vector3d::Ones();
    const Eigen::Vector3d bent = corner_mm / std::sqrt(3) * std::pow(at.squaredNorm() / 3, 3) * at;
    const Eigen::Vector3d place = middle + half.cwiseProduct(at);
    out.push_back({"node " + std::to_string(i + 1),
                   place,
                   std::nullopt,
                   {Eigen::Matrix3d::Identity(),
                    Eigen::Vector3d(place + bent + Eigen::Vector3d(noise(rng), noise(rng), noise(rng)))}});
  }
  return out;
}

TEST(FieldFit, CornersThatOnlyAnExtrapolationMissesAreNoAlarm) {
  std::mt19937 rng(4);
  for (const double corner_mm : {20.0, 60.0}) {
    const auto fit = fit_field(strong_corners(rng, 7, corner_mm));
    ASSERT_TRUE(fit) << fit.error().what;
    double squares = 0, count = 0;
    std::mt19937 again(9);
    const auto others = strong_corners(again, 6, corner_mm);
    for (const FieldSample& s : others) {
      const auto corrected = fit->map.correct(s.measured);
      if (!corrected) continue;  // by its noise beyond the box
      count += 1;
      squares += (corrected->tracker_from_sensor.translation() - *fit->tracker_from_board * s.true_mm).squaredNorm();
    }
    const double truth_mm = std::sqrt(squares / count);
    EXPECT_LT(truth_mm, 0.2);
    EXPECT_NEAR(fit->held_out_mm, truth_mm, 0.1) << corner_mm;
    EXPECT_LT(fit->held_out_worst_mm, 1) << fit->worst;
    EXPECT_EQ(outliers(*fit), 0U);
    // The stronger one makes all lengths 3.7 % longer, which may as well be the board's.
    EXPECT_EQ(verdict_of(*fit).grade, corner_mm < 50 ? Grade::pass : Grade::marginal);
    const auto beyond = std::ranges::count_if(fit->residuals, [](const FieldResidual& r) { return r.beyond; });
    EXPECT_GE(beyond, 8);
    EXPECT_LT(beyond, 7 * 7 * 7 / 2);
    std::cout << "[ figures  ] corners bent by " << corner_mm << " mm: off by " << truth_mm << " mm, held out "
              << fit->held_out_mm << " mm, " << beyond << " places beyond\n";
  }
}

/// The board's own mistakes, in a field that is bent and in one that is not: what the verdict says of them.
struct BoardMistake {
  const char* said;
  Grade grade;
  std::function<void(Eigen::Vector3d& true_mm, int level)> make;
};

TEST(FieldFit, ABoardThatIsNotAsWrittenDownIsToldFromMetal) {
  const std::vector<BoardMistake> mistakes{
      {"% longer than the grid", Grade::fail, [](Eigen::Vector3d& p, int) { p /= 1.15; }},
      {"% shorter than the grid", Grade::fail, [](Eigen::Vector3d& p, int) { p *= 1.06; }},
      {"% longer than the grid", Grade::marginal, [](Eigen::Vector3d& p, int) { p /= 1.03; }},
      {"along z they are", Grade::fail, [](Eigen::Vector3d& p, int) { p.z() /= 1.1; }},
      {"level 2", Grade::fail, [](Eigen::Vector3d& p, int level) { p.z() += level == 2 ? 20 : 0; }},
      {"level 3", Grade::fail, [](Eigen::Vector3d& p, int level) { p.z() += level == 3 ? -5 : 0; }},
      {"level 5", Grade::fail, [](Eigen::Vector3d& p, int level) { p.z() += level == 5 ? 20 : 0; }},
      {"level 4", Grade::fail, [](Eigen::Vector3d& p, int level) { p.x() += level == 4 ? 10 : 0; }},
  };
  for (const double bent_mm : {0.01, 8.0}) {
    const hw_sim::FieldDistortion field(bent_mm, 6);
    for (const BoardMistake& mistake : mistakes) {
      auto samples = grid_samples(field, {}, 6);
      for (int i = 0; i < static_cast<int>(samples.size()); ++i) {
        // As a person measures a board: from its own corner, along its own axes.
        const Eigen::Vector3d step(i % 6, i / 6 % 6, i / 36);
        Eigen::Vector3d& place_mm = samples[static_cast<std::size_t>(i)].true_mm;
        place_mm = step.cwiseProduct(Eigen::Vector3d(100, 96, 100));
        mistake.make(place_mm, i / 36 + 1);
      }
      const auto fit = fit_field(samples);
      ASSERT_TRUE(fit) << fit.error().what;
      const Verdict verdict = verdict_of(*fit);
      const std::string all = fmt::format("{}", fmt::join(verdict.reasons, "\n"));
      EXPECT_NE(all.find(mistake.said), std::string::npos) << all;
      EXPECT_EQ(verdict.grade, std::max(mistake.grade, bent_mm < 1 ? Grade::marginal : Grade::pass)) << all;
    }
  }
}

TEST(FieldFit, NoBentFieldLooksLikeAShiftedLevel) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const auto fit = fit_field(
        grid_samples(hw_sim::FieldDistortion(20, seed), {6, 6, 4 + static_cast<int>(seed % 3), 0.3, 0.1}, seed),
        {FieldBasis::polynomial});
    ASSERT_TRUE(fit) << fit.error().what;
    EXPECT_FALSE(fit->shifted_level) << seed;
    EXPECT_NE(verdict_of(*fit).grade, Grade::fail) << seed;
  }
}

TEST(FieldFit, AMirroredGridIsCalledThat) {
  const auto good = grid_samples(hw_sim::FieldDistortion(10, 6), {}, 6);
  auto mirrored = good, exchanged = good;
  for (FieldSample& s : mirrored) s.true_mm.x() *= -1;
  for (FieldSample& s : exchanged) std::swap(s.true_mm.x(), s.true_mm.y());
  for (const auto& samples : {mirrored, exchanged}) {
    const auto fit = fit_field(samples);
    ASSERT_FALSE(fit);
    EXPECT_NE(fit.error().what.find("mirror image"), std::string::npos) << fit.error().what;
  }
}

TEST(FieldFit, OutliersAreNamedInTheVerdict) {
  auto samples = grid_samples(hw_sim::FieldDistortion(10, 6), {}, 6);
  std::swap(samples[70].measured, samples[71].measured);
  const Verdict verdict = verdict_of(*fit_field(samples));
  EXPECT_NE(verdict.grade, Grade::fail);
  const std::string all = fmt::format("{}", fmt::join(verdict.reasons, "\n"));
  for (const char* name : {"2 of 180 measurements do not fit the rest: ", "node 71 (", "node 72 ("})
    EXPECT_NE(all.find(name), std::string::npos) << all;
}

TEST(FieldFit, EachReasonIsReached) {
  const auto reason = [](const FieldFit& fit) {
    std::string all;
    for (const std::string& r : verdict_of(fit).reasons) all += r + "\n";
    return all;
  };
  const hw_sim::FieldDistortion straight(0.01, 1);
  GridSpec noisy;
  noisy.noise_mm = 1;
  const auto no_need = fit_field(grid_samples(straight, noisy, 1));
  ASSERT_TRUE(no_need);
  EXPECT_NE(reason(*no_need).find("next to nothing"), std::string::npos) << reason(*no_need);
  EXPECT_EQ(verdict_of(*no_need).grade, Grade::marginal);
  noisy.noise_mm = 6;
  const auto hopeless = fit_field(grid_samples(straight, noisy, 1));
  ASSERT_TRUE(hopeless);
  EXPECT_EQ(verdict_of(*hopeless).grade, Grade::fail);

  auto fit = fit_field(grid_samples(hw_sim::FieldDistortion(10, 2), {}, 2));
  ASSERT_TRUE(fit);
  EXPECT_EQ(verdict_of(*fit).grade, Grade::pass) << reason(*fit);
  FieldFit one_place = *fit;
  one_place.held_out_worst_mm = 9 * fit->held_out_mm;
  EXPECT_NE(reason(one_place).find("times the rest"), std::string::npos);
  FieldFit sparse = *fit;
  sparse.mapped_part = 0.4;
  EXPECT_NE(reason(sparse).find("40 % of the box"), std::string::npos);
  FieldFit wrong = *fit;
  for (std::size_t i = 0; i < wrong.residuals.size(); i += 6) wrong.residuals[i].outlier = true;
  EXPECT_EQ(verdict_of(wrong).grade, Grade::marginal);
  for (std::size_t i = 0; i < wrong.residuals.size(); i += 3) wrong.residuals[i].outlier = true;
  EXPECT_EQ(verdict_of(wrong).grade, Grade::fail);
}

TEST(FieldFit, InputThatCannotBeUsedIsNamed) {
  const hw_sim::FieldDistortion field(10, 1);
  const auto what = [](const Result<FieldFit>& fit) { return fit ? "it was taken" : fit.error().what; };
  EXPECT_NE(what(fit_field(grid_samples(field, {3, 3, 2}, 1))).find("18 samples"), std::string::npos);
  auto metres = grid_samples(field, {}, 1);
  for (FieldSample& s : metres) s.true_mm /= 1000;
  EXPECT_NE(what(fit_field(metres)).find("--unit m"), std::string::npos) << what(fit_field(metres));
  auto flat = grid_samples(field, {}, 1);
  std::erase_if(flat, [](const FieldSample& s) { return std::abs(s.measured.translation().z()) > 20; });
  EXPECT_NE(what(fit_field(flat)).find("along each axis"), std::string::npos) << what(fit_field(flat));
  auto sentinel = grid_samples(field, {}, 1);
  sentinel[4].true_mm.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(what(fit_field(sentinel)).find("node 5"), std::string::npos);
}

}  // namespace
}  // namespace birdseye::calibration
