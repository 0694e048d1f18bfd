// Hollow posts, and a head with the cavities that heads have.
#pragma once

#include <random>
#include <vector>

#include "tests/support/turned_solid.hpp"

namespace birdseye::testing {

/// A post with a cavity of air in a wall of plastic, on a stalk. Lengths in mm.
struct DrawnPost {
  enum class Top { cone, flat, open };
  double radius = 3.3, height = 5.5;  ///< of the cavity
  double wall = 1.2, stalk_radius = 2.5, stalk = 8, cap = 3;
  double plastic_hu = 400;
  Top top = Top::cone;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of the cavity
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();   ///< away from the stalk

  [[nodiscard]] Outline outside() const {
    const double half = height / 2;
    const double across = radius + wall;
    Outline outline{{0, top == Top::open ? half : half + cap}};
    if (top == Top::flat) outline.emplace_back(across, half + cap);
    outline.emplace_back(across, half);
    outline.emplace_back(across, -half - wall);
    outline.emplace_back(stalk_radius, -half - wall - 0.5);
    outline.emplace_back(stalk_radius, -half - wall - stalk);
    outline.emplace_back(0, -half - wall - stalk);
    return outline;
  }
  [[nodiscard]] Outline cavity() const {
    return {{0, height / 2}, {radius, height / 2}, {radius, -height / 2}, {0, -height / 2}};
  }
  /// Into air of -1000 HU.
  void draw(DrawnCt& scene, double blur_mm) const {
    scene.add_turned(outside(), centre, axis, blur_mm, plastic_hu + 1000);
    scene.add_turned(cavity(), centre, axis, blur_mm, -plastic_hu - 1000);
  }
};

inline double between(std::mt19937& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}
inline Eigen::Vector3d any_direction(std::mt19937& rng) {
  std::normal_distribution<double> normal;
  return Eigen::Vector3d(normal(rng), normal(rng), normal(rng)).normalized();
}

/// About a centimetre wide, of plastic of 100 to 1000 HU.
inline DrawnPost any_post(std::mt19937& rng, DrawnPost::Top top) {
  DrawnPost post;
  post.radius = between(rng, 2.7, 3.8);
  post.height = between(rng, 4.5, 7.3);
  post.wall = between(rng, 0.8, 1.5);
  post.cap = between(rng, 0.8, 5);
  post.stalk_radius = between(rng, 1.5, 3.5);
  post.plastic_hu = between(rng, 100, 1000);
  post.top = top;
  post.axis = any_direction(rng);
  for (int axis = 0; axis < 3; ++axis) post.centre[axis] = between(rng, -0.5, 0.5);
  return post;
}

constexpr double kHeadBlur_mm = 0.5;

/// Skin, skull and brain, with a large sinus, cells with thin walls between them, ear canals that are open to the
/// outside, nostrils with thin wings, and an airway.
inline DrawnCt drawn_head(const Eigen::Vector3d& spacing_mm, const Eigen::Matrix3d& axes) {
  using Eigen::Vector3d;
  DrawnCt head(Vector3d(150, 180, 150), spacing_mm, axes, -1000);
  const auto ellipsoid = [&](const Vector3d& centre, const Vector3d& radii, double rise_hu) {
    head.add(centre, radii.maxCoeff(), kHeadBlur_mm, rise_hu, [&](const Vector3d& p) {
      const double k = (p - centre).cwiseQuotient(radii).norm();
      return k > 0.05 ? (k - 1) * (p - centre).norm() / k : -radii.minCoeff();
    });
  };
  const auto rod = [&](const Vector3d& a, const Vector3d& b, double radius_mm, double rise_hu) {
    head.add(0.5 * (a + b), 0.5 * (a - b).norm() + radius_mm, kHeadBlur_mm, rise_hu, [&](const Vector3d& p) {
      const double along = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
      return (p - a - along * (b - a)).norm() - radius_mm;
    });
  };
  ellipsoid({0, 0, 0}, {52, 66, 60}, 1040);    // skin
  ellipsoid({0, 0, 0}, {47, 61, 55}, 860);     // skull
  ellipsoid({0, 5, 5}, {41, 50, 44}, -865);    // brain
  rod({0, -62, -20}, {0, -74, -24}, 9, 1040);  // nose
  for (const double side : {-1.0, 1.0}) {
    rod({side * 4.5, -66, -21}, {side * 4.5, -90, -24}, 3, -1040);  // nostril, out through its front
    rod({side * 58, 10, -10}, {side * 42, 10, -8}, 3.5, -1040);     // ear canal
    ellipsoid({side * 20, -48, -22}, {9, 7, 9}, -1900);             // large sinus, in bone
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k)
        ellipsoid({side * (4 + 6.2 * i), -53.5, -4 + 6.2 * k}, {2.6, 2.6, 2.6}, -1900);  // cells, in bone
    }
  }
  rod({0, 20, -52}, {0, 20, -90}, 8, -1040);  // airway, out at the neck
  return head;
}

/// Posts all over a head, each on a stalk to the bone, tilted from it by up to 40 degrees.
inline std::vector<DrawnPost> posts_on(DrawnCt& head, std::mt19937& rng) {
  using Eigen::Vector3d;
  std::vector<DrawnPost> posts;
  const DrawnPost one = any_post(rng, DrawnPost::Top::cone);
  for (const Vector3d& direction :
       {Vector3d(0.9, 0.5, 0.6), Vector3d(-0.9, 0.6, 0.5), Vector3d(0.5, -0.8, 0.8), Vector3d(-0.5, 0.9, -0.4)}) {
    DrawnPost post = one;
    post.top = posts.size() % 2 == 0 ? DrawnPost::Top::cone : DrawnPost::Top::flat;
    const Vector3d outwards = direction.normalized();
    const Vector3d bone = outwards / outwards.cwiseQuotient(Vector3d(46, 60, 54)).norm();
    const Vector3d away = bone.cwiseQuotient(Vector3d(46, 60, 54).cwiseAbs2()).normalized();
    post.axis = (away + 0.6 * any_direction(rng)).normalized();
    post.stalk = 9;
    post.centre = bone + (post.height / 2 + post.wall + post.stalk) * post.axis;
    post.draw(head, kHeadBlur_mm);
    posts.push_back(post);
  }
  return posts;
}

}  // namespace birdseye::testing
