#include "host/registration/similarity/parzen_mutual_information.hpp"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numeric>
#include <random>

#include "host/registration/similarity/joint_histogram.hpp"

namespace birdseye::host {
namespace {

using Grey = std::vector<std::uint8_t>;
using Settings = ParzenMutualInformation::Settings;

constexpr int kWidth = 61, kHeight = 43;  // not a whole number of blocks
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;

struct Pictures {
  Grey video, overlap;
  std::vector<double> synthetic;
  [[nodiscard]] Reference reference() const { return {kWidth, kHeight, video, overlap}; }
};

/// Synthetic values that depend on the video, with noise, over all of the range; a tenth is background.
Pictures random_pictures(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> any(0, 255);
  std::uniform_real_distribution<double> noise(-0.2, 0.2);
  Pictures p;
  for (std::size_t i = 0; i < kPixels; ++i) {
    const int grey = any(random);
    p.video.push_back(static_cast<std::uint8_t>(grey));
    p.overlap.push_back(any(random) < 170 ? 255 : 0);
    const double value = std::clamp(0.4 + 0.4 * std::sin(0.02 * grey) + noise(random), 0.01, 0.99);
    p.synthetic.push_back(any(random) < 25 ? -0.25 : value);
  }
  return p;
}

ParzenMutualInformation measure(const Reference& reference, const Settings& settings = {}) {
  auto made = ParzenMutualInformation::make(reference, settings);
  EXPECT_TRUE(made);
  return *std::move(made);
}

/// Cubic B-spline, by cases.
double window(double t) {
  t = std::abs(t);
  if (t < 1) return (4 - 6 * t * t + 3 * t * t * t) / 6;
  return t < 2 ? (2 - t) * (2 - t) * (2 - t) / 6 : 0;
}

/// Mattes' probabilities summed pixel by pixel and bin by bin. reference_bin: of each pixel.
double plain(const std::vector<int>& reference_bin, const Pictures& p, const Settings& settings) {
  const auto rows = static_cast<std::size_t>(settings.reference_bins);
  const auto columns = static_cast<std::size_t>(settings.synthetic_bins) + 3;
  std::vector<double> joint(rows * columns), of_row(rows), of_column(columns);
  double n = 0;
  for (std::size_t i = 0; i < kPixels; ++i) {
    if (p.overlap[i] == 0) continue;
    n += 1;
    const double at =
        1 + (p.synthetic[i] - settings.lowest) / (settings.highest - settings.lowest) * settings.synthetic_bins;
    for (std::size_t column = 0; column < columns; ++column) {
      joint[static_cast<std::size_t>(reference_bin[i]) * columns + column] += window(at - static_cast<double>(column));
    }
  }
  for (std::size_t k = 0; k < joint.size(); ++k) {
    joint[k] /= n;
    of_row[k / columns] += joint[k];
    of_column[k % columns] += joint[k];
  }
  double mi = 0;
  for (std::size_t k = 0; k < joint.size(); ++k) {
    if (joint[k] > 0) mi += joint[k] * std::log(joint[k] / (of_row[k / columns] * of_column[k % columns]));
  }
  return mi;
}

TEST(ParzenMutualInformation, AgreesWithAPlainComputation) {
  for (const Settings& settings : {Settings{}, Settings{8, 20, -0.25, 1}, Settings{5, 7, -0.5, 1.5}}) {
    Pictures p = random_pictures(1);
    // Levels that are equally frequent, so that there is no doubt about the bins.
    std::vector<int> bins(kPixels);
    int next = 0;
    for (std::size_t i = 0; i < kPixels; ++i) {
      if (p.overlap[i] != 0) bins[i] = next++ % settings.reference_bins;
      p.video[i] = static_cast<std::uint8_t>(10 + 7 * bins[i]);
    }
    EXPECT_NEAR(measure(p.reference(), settings).value(p.synthetic), plain(bins, p, settings), 1e-12);
  }
}

TEST(ParzenMutualInformation, GradientIsThatOfTheValue) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    Pictures p = random_pictures(seed);
    const ParzenMutualInformation mi = measure(p.reference());
    std::vector<double> gradient(kPixels, 7);
    EXPECT_EQ(mi.value_and_gradient(p.synthetic, gradient), mi.value(p.synthetic));
    std::mt19937 random(seed);
    std::normal_distribution<double> any;
    // Along random directions, background apart: it lies where the range ends, and greys are cut there.
    for (int n = 0; n < 5; ++n) {
      std::vector<double> direction, at = p.synthetic;
      double slope = 0;
      for (std::size_t i = 0; i < kPixels; ++i) {
        direction.push_back(p.synthetic[i] < 0 ? 0 : any(random));
        slope += direction[i] * gradient[i];
      }
      // Fourth order differences: their own error, by halving the step, is below 1e-8 of the slope.
      const auto value = [&](double step) {
        for (std::size_t i = 0; i < kPixels; ++i) at[i] = p.synthetic[i] + step * direction[i];
        return mi.value(at);
      };
      constexpr double kStep = 1e-5;
      const double measured =
          (8 * (value(kStep) - value(-kStep)) - (value(2 * kStep) - value(-2 * kStep))) / (12 * kStep);
      double norm = 0;
      for (const double g : gradient) norm += g * g;
      EXPECT_NEAR(measured, slope, 1e-6 * std::sqrt(norm)) << seed;
    }
    for (std::size_t i = 0; i < kPixels; i += 97) {  // and pixel by pixel
      if (p.synthetic[i] < 0) continue;
      std::vector<double> at = p.synthetic;
      constexpr double kStep = 1e-4;
      const auto value = [&](double step) {
        at[i] = p.synthetic[i] + step;
        return mi.value(at);
      };
      const double measured =
          (8 * (value(kStep) - value(-kStep)) - (value(2 * kStep) - value(-2 * kStep))) / (12 * kStep);
      EXPECT_NEAR(measured, gradient[i], 1e-6 * std::abs(gradient[i]) + 1e-11) << i;
      EXPECT_TRUE(p.overlap[i] != 0 || gradient[i] == 0) << i;
    }
  }
}

TEST(ParzenMutualInformation, CutsGreysBeyondTheRange) {
  Pictures p = random_pictures(4);
  const ParzenMutualInformation mi = measure(p.reference());
  std::vector<double> beyond = p.synthetic, cut = p.synthetic, gradient(kPixels);
  for (std::size_t i = 0; i < kPixels; i += 5) {
    beyond[i] = i % 2 == 0 ? 3.0 : -1.0;
    cut[i] = i % 2 == 0 ? 1.0 : -0.25;
  }
  beyond[3] = std::nan("");
  cut[3] = -0.25;
  EXPECT_EQ(mi.value_and_gradient(beyond, gradient), mi.value(cut));
  for (std::size_t i = 0; i < kPixels; i += 5) EXPECT_EQ(gradient[i], 0);
  EXPECT_EQ(gradient[3], 0);
}

TEST(ParzenMutualInformation, ApproachesTheHistogramOnSmoothPictures) {
  // For greys that are equally frequent, bins of equal frequency and of equal width are the same, and the two forms
  // differ only by the window. It blurs the picture across bins: a little less is found, the less so the narrower they
  // are.
  constexpr int kSide = 256;
  Grey video, rounded;
  std::vector<double> synthetic;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      video.push_back(static_cast<std::uint8_t>(x));
      synthetic.push_back((0.5 * x + 0.5 * y + 0.5) / kSide);
      rounded.push_back(static_cast<std::uint8_t>(256 * synthetic.back()));
    }
  }
  const Grey overlap(video.size(), 1);
  double last = 1;
  for (const int bins : {8, 16, 32, 64}) {
    const auto parzen = ParzenMutualInformation::make({kSide, kSide, video, overlap}, {bins, bins, 0, 1});
    ASSERT_TRUE(parzen);
    const double histogram = JointHistogram(video, overlap, bins).entropies(rounded).mutual_information();
    const double less = (histogram - parzen->value(synthetic)) / histogram;
    EXPECT_GT(less, 0) << bins;
    EXPECT_LT(less, 0.6 * last) << bins;
    last = less;
  }
  EXPECT_LT(last, 0.05);
}

TEST(ParzenMutualInformation, IsNotNegativeAndNothingForAConstantPicture) {
  const Pictures p = random_pictures(6);
  const ParzenMutualInformation mi = measure(p.reference());
  EXPECT_GE(mi.value(p.synthetic), 0);
  for (const double grey : {-0.25, 0.0, 0.3, 1.0}) {
    std::vector<double> constant(kPixels, grey), gradient(kPixels);
    EXPECT_NEAR(mi.value_and_gradient(constant, gradient), 0, 1e-12);
    for (const double g : gradient) EXPECT_NEAR(g, 0, 1e-12);
  }
}

TEST(ParzenMutualInformation, IsTheSameToTheBitForAnyNumberOfThreads) {
  const Pictures p = random_pictures(7);
  const ParzenMutualInformation mi = measure(p.reference());
  std::vector<double> many(kPixels), single(kPixels);
  const double value = mi.value_and_gradient(p.synthetic, many);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(mi.value_and_gradient(p.synthetic, single), value);
  EXPECT_EQ(many, single);
}

TEST(ParzenMutualInformation, RefusesWhatCannotBeCompared) {
  const Pictures p = random_pictures(8);
  for (const Settings& settings : {Settings{1, 32, 0, 1}, Settings{32, 0, 0, 1}, Settings{32, 32, 1, 1}}) {
    const auto made = ParzenMutualInformation::make(p.reference(), settings);
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().code, Errc::bad_value);
  }
  const Grey none(kPixels, 0);
  EXPECT_FALSE(ParzenMutualInformation::make({kWidth, kHeight, p.video, none}));
  EXPECT_FALSE(ParzenMutualInformation::make({kWidth, kHeight, none, p.overlap}));
}

}  // namespace
}  // namespace birdseye::host
