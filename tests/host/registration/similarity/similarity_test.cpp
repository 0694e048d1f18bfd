#include "host/registration/similarity/similarity.hpp"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include <cmath>
#include <map>
#include <numeric>
#include <random>

#include "host/registration/similarity/joint_histogram.hpp"

namespace birdseye::host {
namespace {

using ::testing::HasSubstr;
using Grey = std::vector<std::uint8_t>;

constexpr int kPictureWidth = 157, kPictureHeight = 91;  // not a whole number of blocks
constexpr std::size_t kPicturePixels = std::size_t{kPictureWidth} * kPictureHeight;

std::size_t index(int x, int y) {
  return static_cast<std::size_t>(y) * kPictureWidth + static_cast<std::size_t>(x);
}

Grey noise(unsigned seed, int levels = 256) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> any(0, levels - 1);
  Grey grey(kPicturePixels);
  for (auto& g : grey) g = static_cast<std::uint8_t>(any(random));
  return grey;
}

/// Waves; alike for shifts that are.
Grey waves(double shift_px) {
  Grey grey;
  for (int y = 0; y < kPictureHeight; ++y) {
    for (int x = 0; x < kPictureWidth; ++x) {
      grey.push_back(static_cast<std::uint8_t>(
          std::lround(127 + 70 * std::sin(0.11 * (x - shift_px)) + 50 * std::cos(0.13 * y + 0.03 * (x - shift_px)))));
    }
  }
  return grey;
}

Grey everywhere() {
  return Grey(kPicturePixels, 1);
}

/// A third of the pixels, in no order.
Grey somewhere() {
  Grey mask = noise(99, 3);
  for (auto& m : mask) m = m == 0 ? 255 : 0;
  return mask;
}

double value(const std::string& name, const Grey& a, const Grey& b, const Grey& overlap, int bins = 64) {
  const auto measure = make_similarity(name, {kPictureWidth, kPictureHeight, a, overlap}, bins);
  EXPECT_TRUE(measure) << name;
  return measure ? (*measure)->value(b) : NAN;
}

/// Equations of the textbooks, from a map of pairs.
struct Plain {
  double a = 0, b = 0, joint = 0;
};
Plain plain_entropies(const Grey& a, const Grey& b, const Grey& overlap, int bins) {
  std::map<int, double> of_a, of_b;
  std::map<std::pair<int, int>, double> joint;
  double n = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (overlap[i] == 0) continue;
    const int x = a[i] * bins / 256, y = b[i] * bins / 256;
    of_a[x] += 1;
    of_b[y] += 1;
    joint[{x, y}] += 1;
    n += 1;
  }
  Plain h;
  for (const auto& [bin, count] : of_a) h.a -= count / n * std::log(count / n);
  for (const auto& [bin, count] : of_b) h.b -= count / n * std::log(count / n);
  for (const auto& [bin, count] : joint) h.joint -= count / n * std::log(count / n);
  return h;
}

double plain_correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto n = static_cast<double>(a.size());
  const double mean_a = std::accumulate(a.begin(), a.end(), 0.0) / n;
  const double mean_b = std::accumulate(b.begin(), b.end(), 0.0) / n;
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - mean_a) * (b[i] - mean_b);
    aa += (a[i] - mean_a) * (a[i] - mean_a);
    bb += (b[i] - mean_b) * (b[i] - mean_b);
  }
  return ab / std::sqrt(aa * bb);
}

TEST(Similarity, AgreesWithAPlainComputation) {
  const Grey a = waves(0), b = noise(2);
  for (const Grey& overlap : {everywhere(), somewhere()}) {
    for (const int bins : {2, 7, 64, 128}) {
      for (const Grey& other : {b, waves(3)}) {
        const Plain h = plain_entropies(a, other, overlap, bins);
        EXPECT_NEAR(value("mi", a, other, overlap, bins), h.a + h.b - h.joint, 1e-11) << bins;
        EXPECT_NEAR(value("nmi", a, other, overlap, bins), (h.a + h.b) / h.joint, 1e-11) << bins;
      }
    }
    std::vector<double> x, y;
    for (std::size_t i = 0; i < kPicturePixels; ++i) {
      if (overlap[i] == 0) continue;
      x.push_back(a[i]);
      y.push_back(b[i]);
    }
    EXPECT_NEAR(value("ncc", a, b, overlap), plain_correlation(x, y), 1e-11);
  }
}

TEST(Similarity, GradientCorrelationLooksOnlyAtNeighboursInTheOverlap) {
  const Grey a = waves(0), b = waves(4);
  Grey overlap = everywhere();
  for (int y = 30; y < 40; ++y) {
    for (int x = 50; x < 90; ++x) overlap[index(x, y)] = 0;
  }
  std::array<std::vector<double>, 2> of_a, of_b;
  for (int y = 1; y + 1 < kPictureHeight; ++y) {
    for (int x = 1; x + 1 < kPictureWidth; ++x) {
      bool inside = true;
      std::array<double, 2> in_a{}, in_b{};
      for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
          const auto at = index(x + i, y + j);
          inside = inside && overlap[at] != 0;
          in_a[0] += i * (2 - std::abs(j)) * a[at];
          in_a[1] += j * (2 - std::abs(i)) * a[at];
          in_b[0] += i * (2 - std::abs(j)) * b[at];
          in_b[1] += j * (2 - std::abs(i)) * b[at];
        }
      }
      for (std::size_t axis = 0; axis < 2 && inside; ++axis) {
        of_a[axis].push_back(in_a[axis]);
        of_b[axis].push_back(in_b[axis]);
      }
    }
  }
  const double expected = (plain_correlation(of_a[0], of_b[0]) + plain_correlation(of_a[1], of_b[1])) / 2;
  EXPECT_NEAR(value("gradient", a, b, overlap), expected, 1e-11);
  Grey other = b;
  for (std::size_t i = 0; i < kPicturePixels; ++i) other[i] = overlap[i] == 0 ? 255 : b[i];
  EXPECT_EQ(value("gradient", a, other, overlap), value("gradient", a, b, overlap));
}

TEST(Similarity, IsGreatestForThePictureItself) {
  const Grey a = waves(0);
  for (const std::string& name : similarity_names()) {
    const double itself = value(name, a, a, everywhere());
    double last = itself;
    for (const double shift_px : {1, 2, 4}) {
      const double shifted = value(name, a, waves(shift_px), everywhere());
      EXPECT_LT(shifted, last) << name << " " << shift_px;
      last = shifted;
    }
  }
  EXPECT_NEAR(value("mi", a, a, everywhere()), plain_entropies(a, a, everywhere(), 64).a, 1e-11);  // MI(a, a) = H(a)
  for (const auto& [name, most] : {std::pair("nmi", 2.0), std::pair("ncc", 1.0), std::pair("gradient", 1.0)}) {
    EXPECT_NEAR(value(name, a, a, everywhere()), most, 1e-12) << name;
  }
}

TEST(Similarity, IsSymmetric) {
  const Grey a = waves(0), b = waves(5);
  for (const std::string& name : similarity_names()) {
    EXPECT_NEAR(value(name, a, b, everywhere()), value(name, b, a, everywhere()), 1e-11) << name;
  }
}

TEST(Similarity, MutualInformationDoesNotCareWhatTheLevelsAre) {
  // With a bin a level it stays the same under any exchange of levels: a negative, or the colours of an atlas.
  const Grey a = waves(0), b = waves(3);
  std::vector<std::uint8_t> bin(64);
  std::iota(bin.begin(), bin.end(), std::uint8_t{0});
  std::shuffle(bin.begin(), bin.end(), std::mt19937(4));
  Grey exchanged;
  for (const std::uint8_t g : b) exchanged.push_back(static_cast<std::uint8_t>(4 * bin[g / 4]));
  for (const char* name : {"mi", "nmi"}) {
    EXPECT_NEAR(value(name, a, exchanged, everywhere()), value(name, a, b, everywhere()), 1e-11) << name;
    EXPECT_NEAR(value(name, exchanged, a, everywhere()), value(name, b, a, everywhere()), 1e-11) << name;
  }
  EXPECT_LT(value("ncc", a, exchanged, everywhere()), 0.5);
}

TEST(Similarity, OfIndependentNoiseIsItsBias) {
  // MI of independent pictures is not zero for finitely many pixels but, in the mean, (bins - 1)^2 / 2n (Miller 1955);
  // 2n MI is chi squared distributed: 5 standard deviations.
  for (const int bins : {8, 16}) {
    const double freedom = (bins - 1.0) * (bins - 1.0);
    const double mi = value("mi", noise(1), noise(2), everywhere(), bins);
    EXPECT_GE(mi, 0);
    EXPECT_NEAR(2 * kPicturePixels * mi, freedom, 5 * std::sqrt(2 * freedom)) << bins;
  }
  EXPECT_NEAR(value("ncc", noise(1), noise(2), everywhere()), 0, 5 / std::sqrt(kPicturePixels));
}

TEST(Similarity, OfAConstantPictureIsNothing) {
  const Grey a = waves(0), constant(kPicturePixels, 90);
  EXPECT_NEAR(value("mi", a, constant, everywhere()), 0, 1e-12);
  EXPECT_NEAR(value("nmi", a, constant, everywhere()), 1, 1e-12);
  EXPECT_EQ(value("ncc", a, constant, everywhere()), 0);
  EXPECT_EQ(value("gradient", a, constant, everywhere()), 0);
}

TEST(Similarity, IsTheSameToTheBitForAnyNumberOfThreads) {
  const Grey a = waves(0), b = noise(3);
  for (const std::string& name : similarity_names()) {
    const double many = value(name, a, b, everywhere());
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(value(name, a, b, everywhere()), many) << name;
  }
}

TEST(JointHistogram, CountsEveryPixelOfLargeFlatPictures) {
  // More than fits the 16 bits of a task's table, were it not shared out.
  const Grey flat(3000000, 200), all(3000000, 1);
  const std::vector<std::uint32_t> counts = JointHistogram(flat, all, 64).count(flat);
  EXPECT_EQ(counts[50 * 64 + 50], 3000000U);
  EXPECT_EQ(std::accumulate(counts.begin(), counts.end(), 0U), 3000000U);
}

TEST(Similarity, RefusesWhatCannotBeCompared) {
  const Grey a = waves(0), all = everywhere();
  const auto refusal = [](const std::string& name, const Reference& reference, int bins = 64) {
    const auto measure = make_similarity(name, reference, bins);
    EXPECT_FALSE(measure);
    return measure ? Error{} : measure.error();
  };
  EXPECT_THAT(refusal("sad", {kPictureWidth, kPictureHeight, a, all}).what, HasSubstr("mi, nmi, ncc, gradient"));
  EXPECT_THAT(refusal("mi", {kPictureWidth, kPictureHeight, a, all}, 1).what, HasSubstr("2 to 128"));
  EXPECT_THAT(refusal("mi", {kPictureWidth, kPictureHeight, a, std::span(all).first(100)}).what,
              HasSubstr("overlap mask: 100"));
  EXPECT_THAT(refusal("mi", {kPictureWidth, kPictureHeight + 1, a, all}).what, HasSubstr("reference picture"));
  const Grey none(kPicturePixels, 0), constant(kPicturePixels, 80);
  EXPECT_EQ(refusal("mi", {kPictureWidth, kPictureHeight, a, none}).code, Errc::degenerate);
  EXPECT_EQ(refusal("ncc", {kPictureWidth, kPictureHeight, constant, all}).code, Errc::degenerate);
  Grey nearly = constant;
  nearly[7] = 81;  // in the same of 64 bins
  EXPECT_EQ(refusal("mi", {kPictureWidth, kPictureHeight, nearly, all}).code, Errc::degenerate);
  Grey dots = all;  // no pixel has all its neighbours
  for (std::size_t i = 0; i < kPicturePixels; i += 2) dots[i] = 0;
  EXPECT_EQ(refusal("gradient", {kPictureWidth, kPictureHeight, a, dots}).code, Errc::degenerate);
}

}  // namespace
}  // namespace birdseye::host
