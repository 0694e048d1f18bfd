#include "hw-sim/camera/cavity_coat.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hw-sim/camera/blur.hpp"

namespace birdseye::hw_sim {
namespace {

using Eigen::Vector3f;

Cavity round_organ() {
  Cavity cavity;
  cavity.organ =
      closed_surface([](const Eigen::Vector3d& p) { return p.norm() - 70; }, {-80, -80, -80}, {80, 80, 80}, 2);
  return cavity;
}

bool is_bloody(const Reflectance& r) {
  return r.albedo.y() < 0.03F;
}

TEST(CavityCoat, BloodCoversTheShareThatIsAskedForAndTheLessIsPartOfTheMore) {
  const SolidNoise noise(7);
  Cavity cavity = round_organ();
  std::vector<bool> less(cavity.organ.vertices.size(), false);
  for (const double share : {0.1, 0.3, 0.6}) {
    cavity.blood = share;
    const CavityCoat coat(noise, cavity);
    // By area, where the coat itself goes by vertices.
    double covered = 0;
    double all = 0;
    for (const auto& [a, b, c] : cavity.organ.triangles) {
      const Vector3f& p = cavity.organ.vertices[a];
      const Vector3f& q = cavity.organ.vertices[b];
      const Vector3f& r = cavity.organ.vertices[c];
      const double area = (q - p).cross(r - p).norm();
      all += area;
      if (is_bloody(coat.at((p + q + r) / 3, kOrganGeometry))) covered += area;
    }
    EXPECT_NEAR(covered / all, share, 0.03);
    for (std::size_t i = 0; i < less.size(); ++i) {
      const bool now = is_bloody(coat.at(cavity.organ.vertices[i], kOrganGeometry));
      EXPECT_TRUE(now || !less[i]);
      less[i] = now;
    }
    EXPECT_FALSE(is_bloody(coat.at({100, 30, 20}, kWallGeometry)));
  }
}

TEST(CavityCoat, WithoutTextureAnOrganIsPlainAndTwiceItIsTwiceAsVaried) {
  const SolidNoise noise(7);
  for (const Coat kind : {Coat::liver, Coat::skin}) {
    Cavity cavity = round_organ();
    cavity.coat = kind;
    const auto deviation = [&](double texture) {
      cavity.texture = texture;
      const CavityCoat coat(noise, cavity);
      double sum = 0, sum2 = 0;
      for (const Vector3f& p : cavity.organ.vertices) {
        const double red = coat.at(p, kOrganGeometry).albedo.x();
        sum += red;
        sum2 += red * red;
      }
      const auto n = static_cast<double>(cavity.organ.vertices.size());
      return std::sqrt(std::max(0.0, sum2 / n - sum * sum / (n * n)));
    };
    EXPECT_LT(deviation(0), 1e-4);
    EXPECT_NEAR(deviation(2) / deviation(1), 2, 0.1);
  }
}

TEST(CavityCoat, WetMultipliesHighlightsAlone) {
  const SolidNoise noise(7);
  Cavity cavity = round_organ();
  const CavityCoat usual(noise, cavity);
  cavity.wet = 2.5;
  const CavityCoat wet(noise, cavity);
  for (const unsigned geometry : {kOrganGeometry, kWallGeometry, kInstrumentGeometry}) {
    const Vector3f p(12, 30, -60);
    EXPECT_FLOAT_EQ(wet.at(p, geometry).gloss, 2.5F * usual.at(p, geometry).gloss);
    EXPECT_EQ(wet.at(p, geometry).albedo, usual.at(p, geometry).albedo);
  }
}

TEST(Blur, KeepsTheLightAndSpreadsItByItsSigma) {
  constexpr int kWidth = 61, kHeight = 51;
  constexpr double kSigma_px = 2.5;
  std::vector<Vector3f> light(std::size_t{kWidth} * kHeight, Vector3f::Zero());
  light[25 * kWidth + 30] = Vector3f(1, 2, 3);
  blur(light, kWidth, kHeight, kSigma_px);
  double sum = 0, along2 = 0, across2 = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double here = light[static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(x)].y();
      sum += here;
      along2 += here * (x - 30) * (x - 30);
      across2 += here * (y - 25) * (y - 25);
    }
  }
  EXPECT_NEAR(sum, 2, 1e-4);
  EXPECT_NEAR(std::sqrt(along2 / sum), kSigma_px, 0.01);
  EXPECT_NEAR(std::sqrt(across2 / sum), kSigma_px, 0.01);
}

}  // namespace
}  // namespace birdseye::hw_sim
