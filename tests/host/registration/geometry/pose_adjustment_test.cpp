#include "host/registration/geometry/pose_adjustment.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "calibration/geometry/rotations.hpp"

namespace birdseye::host {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kAway_mm = 150;

PinholeView view_from(const Eigen::Vector3d& eye_mm) {
  PinholeView out;
  out.width_px = 768;
  out.height_px = 576;
  out.fx_px = out.fy_px = 700;
  out.cx_px = 384;
  out.cy_px = 288;
  const Eigen::Vector3d z = -eye_mm.normalized(), x = Eigen::Vector3d::UnitY().cross(z).normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  return moved(out, Transform<Camera, Patient>(rotation, Eigen::Vector3d(-rotation * eye_mm)));
}

/// Five views of the middle, as one keeps them.
std::vector<PinholeView> five_views() {
  std::vector<PinholeView> out;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {0.5, 0.1}, {-0.5, 0.0}, {0.1, 0.5}, {0.0, -0.5}})
    out.push_back(view_from(kAway_mm * Eigen::Vector3d(x, y, -1).normalized()));
  return out;
}

class Noise {
 public:
  Eigen::Vector3d draw(double sigma) {
    return {sigma * normal_(random_), sigma * normal_(random_), sigma * normal_(random_)};
  }
  double uniform(double most) { return std::uniform_real_distribution<double>(-most, most)(random_); }

  /// A view whose pose errs.
  PinholeView erring(const PinholeView& view, const PoseNoise& noise) {
    const Eigen::Matrix3d rotation = rotation_exp(draw(noise.angle_rad)) * view.camera_from_patient.rotation();
    const Eigen::Vector3d eye_mm = view.eye_in_patient_mm + draw(noise.eye_mm);
    return moved(view, Transform<Camera, Patient>(rotation, Eigen::Vector3d(-rotation * eye_mm)));
  }

 private:
  std::mt19937 random_{1};
  std::normal_distribution<double> normal_;
};

/// Of places about the middle, as views that are where they are see them; a share of them wrong.
std::vector<TextureMatch> matches_of(const std::vector<PinholeView>& views, Noise& noise, double sigma_px,
                                     double wrong) {
  std::vector<TextureMatch> out;
  std::size_t places = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    for (int i = 0; i < 60; ++i) {
      const Eigen::Vector3d place_mm(noise.uniform(40), noise.uniform(40), noise.uniform(15));
      const auto here = views[v].project(place_mm);
      const std::size_t w = (v + 1 + static_cast<std::size_t>(i) % (views.size() - 1)) % views.size();
      const auto there = views[w].project(place_mm);
      Eigen::Vector2d other_px(there.x_px, there.y_px);
      other_px += noise.draw(sigma_px).head<2>();
      if (0.5 * (1 + noise.uniform(1)) < wrong) other_px += Eigen::Vector2d(noise.uniform(20), noise.uniform(20));
      TextureMatch match;
      match.place = places++;
      match.view = v;
      match.at_px = {here.x_px, here.y_px};
      match.depth_mm = here.depth_mm + noise.uniform(5);
      match.other_view = w;
      match.other_px = other_px;
      out.push_back(match);
    }
  }
  return out;
}

/// How far two views are apart on where the ray of one lies in the other, in pixels, root mean square over a grid.
double disagreement_px(const std::vector<PinholeView>& truth, const std::vector<PinholeView>& views) {
  double sum = 0, count = 0;
  for (std::size_t v = 0; v < truth.size(); ++v) {
    for (std::size_t w = 0; w < truth.size(); ++w) {
      if (v == w) continue;
      for (int i = 0; i < 25; ++i) {
        const Eigen::Vector3d place_mm(15.0 * (i % 5 - 2), 15.0 * (i / 5 - 2), 0);  // NOLINT(bugprone-integer-division)
        const auto here = truth[v].project(place_mm), there = truth[w].project(place_mm);
        const Eigen::Vector3d ray = views[v].ray(here.x_px, here.y_px);
        const auto pixel_at = [&](double depth_mm) -> Eigen::Vector2d {
          const auto pixel = views[w].project(views[v].eye_in_patient_mm + depth_mm * ray);
          return {pixel.x_px, pixel.y_px};
        };
        const Eigen::Vector2d along = (pixel_at(here.depth_mm + 1) - pixel_at(here.depth_mm - 1)).normalized();
        const Eigen::Vector2d off = Eigen::Vector2d(there.x_px, there.y_px) - pixel_at(here.depth_mm);
        sum += std::pow(along.x() * off.y() - along.y() * off.x(), 2);
        count += 1;
      }
    }
  }
  return std::sqrt(sum / count);
}

std::vector<PinholeView> placed(std::vector<PinholeView> views, const AdjustedPoses& poses) {
  for (std::size_t n = 0; n < views.size(); ++n) views[n] = moved(views[n], poses.camera_from_patient[n]);
  return views;
}

TEST(AdjustedPoses, AgreeWithWhatTheViewsShowThoughAFifthOfTheMatchesIsWrong) {
  constexpr PoseNoise kNoise{0.6, 0.2 * kDegree};
  Noise noise;
  const std::vector<PinholeView> truth = five_views();
  std::vector<PinholeView> given;
  for (const PinholeView& view : truth) given.push_back(noise.erring(view, kNoise));
  const auto adjusted = adjusted_poses(given, matches_of(truth, noise, 0.4, 0.2));
  ASSERT_TRUE(adjusted);
  EXPECT_GT(disagreement_px(truth, given), 2.0);
  EXPECT_LT(disagreement_px(truth, placed(given, *adjusted)), 0.2);
  EXPECT_NEAR(adjusted->noise.eye_mm, kNoise.eye_mm, 0.6 * kNoise.eye_mm);
  EXPECT_NEAR(adjusted->noise.angle_rad, kNoise.angle_rad, 0.6 * kNoise.angle_rad);
  EXPECT_GT(adjusted->matches, 220U);
}

TEST(AdjustedPoses, LeavePosesThatAreRightWhereTheyAre) {
  Noise noise;
  const std::vector<PinholeView> truth = five_views();
  const auto adjusted = adjusted_poses(truth, matches_of(truth, noise, 0.4, 0.2));
  ASSERT_TRUE(adjusted);
  EXPECT_LT(disagreement_px(truth, placed(truth, *adjusted)), 0.1);
  EXPECT_LT(adjusted->noise.eye_mm, 0.05);
  EXPECT_LT(adjusted->noise.angle_rad, 0.02 * kDegree);
}

TEST(AdjustedPoses, AreNoneWhereTheMatchesSayNothing) {
  Noise noise;
  const std::vector<PinholeView> truth = five_views();
  EXPECT_FALSE(adjusted_poses(truth, matches_of(truth, noise, 60, 0)));
  EXPECT_FALSE(adjusted_poses(truth, std::vector<TextureMatch>{}));
}

/// Many sets of erring poses, each with the motion of everything by which they would all be nearest to the truth.
TEST(CommonPoseError, IsWhatErringPosesLeaveOfACommonMotion) {
  constexpr PoseNoise kNoise{0.5, 0.3 * kDegree};
  constexpr int kSets = 4000;
  const std::vector<PinholeView> views = five_views();
  const Eigen::Vector3d about_mm(5, 0, 0), place_mm(20, -30, 10);
  Noise noise;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int set = 0; set < kSets; ++set) {
    Eigen::MatrixXd rows(6 * static_cast<Eigen::Index>(views.size()), 7);
    Eigen::VectorXd errors(rows.rows());
    for (Eigen::Index n = 0; n < static_cast<Eigen::Index>(views.size()); ++n) {
      const Eigen::Vector3d from = views[static_cast<std::size_t>(n)].eye_in_patient_mm - about_mm;
      rows.middleRows<3>(6 * n) << Eigen::Matrix3d::Identity(), -cross_matrix(from), from;
      rows.middleRows<3>(6 * n) /= kNoise.eye_mm;
      rows.middleRows<3>(6 * n + 3) << Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero();
      rows.middleRows<3>(6 * n + 3) /= kNoise.angle_rad;
      errors.segment<3>(6 * n) = noise.draw(1);
      errors.segment<3>(6 * n + 3) = noise.draw(1);
    }
    const Eigen::VectorXd motion = rows.colPivHouseholderQr().solve(errors);
    const Eigen::Vector3d from = place_mm - about_mm, turn = motion.segment<3>(3);
    const Eigen::Vector3d moved_mm = motion.head<3>() + turn.cross(from) + motion[6] * from;
    sum += moved_mm * moved_mm.transpose();
  }
  const Eigen::Matrix3d found = CommonPoseError(views, kNoise).covariance(place_mm);
  EXPECT_LT((found - sum / kSets).norm(), 0.08 * found.norm()) << found << "\n" << sum / kSets;
}

}  // namespace
}  // namespace birdseye::host
