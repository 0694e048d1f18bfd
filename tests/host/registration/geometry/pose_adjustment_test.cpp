#include "host/registration/geometry/pose_adjustment.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <span>

#include "calibration/geometry/rotations.hpp"
#include "host/registration/geometry/view_agreement.hpp"

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
  EXPECT_LT(disagreement_px(truth, placed(given, adjusted->poses)), 0.2);
  EXPECT_NEAR(adjusted->poses.noise.eye_mm, kNoise.eye_mm, 0.6 * kNoise.eye_mm);
  EXPECT_NEAR(adjusted->poses.noise.angle_rad, kNoise.angle_rad, 0.6 * kNoise.angle_rad);
  EXPECT_GT(adjusted->poses.matches, 220U);
}

/// Of one record of a miniBIRD whose sensor is a scope's length from the lens.
TEST(AdjustedPoses, AgreeWhereSingleRecordsPutTheViewsTensOfPixelsOff) {
  constexpr PoseNoise kNoise{3, 0.5 * kDegree};
  Noise noise;
  const std::vector<PinholeView> truth = five_views();
  for (int draw = 0; draw < 10; ++draw) {
    std::vector<PinholeView> given;
    for (const PinholeView& view : truth) given.push_back(noise.erring(view, kNoise));
    const auto adjusted = adjusted_poses(given, matches_of(truth, noise, 0.4, 0.5), {5, 0.8 * kDegree});
    ASSERT_TRUE(adjusted);
    EXPECT_GT(disagreement_px(truth, given), 10);
    EXPECT_LT(disagreement_px(truth, placed(given, adjusted->poses)), 0.4);
  }
}

TEST(AdjustedPoses, LeavePosesThatAreRightWhereTheyAre) {
  Noise noise;
  const std::vector<PinholeView> truth = five_views();
  const auto adjusted = adjusted_poses(truth, matches_of(truth, noise, 0.4, 0.2));
  ASSERT_TRUE(adjusted);
  EXPECT_LT(disagreement_px(truth, placed(truth, adjusted->poses)), 0.1);
  EXPECT_LT(adjusted->poses.noise.eye_mm, 0.05);
  EXPECT_LT(adjusted->poses.noise.angle_rad, 0.02 * kDegree);
}

TEST(AdjustedPoses, AreNoneWhereTheMatchesSayNothing) {
  Noise noise;
  const std::vector<PinholeView> truth = five_views();
  EXPECT_FALSE(adjusted_poses(truth, matches_of(truth, noise, 60, 0)));
  EXPECT_FALSE(adjusted_poses(truth, std::vector<TextureMatch>{}));
}

/// Five views from nearly one side, as one port lets a laparoscope go.
std::vector<PinholeView> narrow_views() {
  std::vector<PinholeView> out;
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {0.12, 0.03}, {-0.12, 0.0}, {0.03, 0.1}, {0.0, -0.1}})
    out.push_back(view_from(kAway_mm * Eigen::Vector3d(x, y, -1).normalized()));
  return out;
}

/// By how much shift, turn and scale err that bring the places of the truth to where they were found.
Eigen::Vector<double, 7> common_motion(std::span<const Eigen::Vector3d> truth_mm,
                                       std::span<const Eigen::Vector3d> found_mm, const Eigen::Vector3d& about_mm) {
  Eigen::MatrixXd rows(3 * static_cast<Eigen::Index>(truth_mm.size()), 7);
  Eigen::VectorXd moves(rows.rows());
  for (std::size_t i = 0; i < truth_mm.size(); ++i) {
    const Eigen::Vector3d from = truth_mm[i] - about_mm;
    const auto at = 3 * static_cast<Eigen::Index>(i);
    rows.middleRows<3>(at) << Eigen::Matrix3d::Identity(), -cross_matrix(from), from;
    moves.segment<3>(at) = found_mm[i] - truth_mm[i];
  }
  return rows.colPivHouseholderQr().solve(moves);
}

/// Many sets of erring poses: how far off everything is found, against how far it is expected to be. From one side the
/// depth of it all errs most, and by far more than the eyes do.
TEST(PoseBundle, ExpectsTheCommonMotionThatErringPosesLeave) {
  constexpr PoseNoise kNoise{0.3, 0.05 * kDegree};
  constexpr double kScale = 100;  // every match is right
  constexpr int kSets = 150;
  const std::vector<PinholeView> truth = narrow_views();
  Noise noise;
  double found_mm2 = 0, expected_mm2 = 0, side_mm2 = 0, expected_side_mm2 = 0;
  for (int set = 0; set < kSets; ++set) {
    std::vector<PinholeView> given;
    for (const PinholeView& view : truth) given.push_back(noise.erring(view, kNoise));
    const std::vector<TextureMatch> matches = matches_of(truth, noise, 0.5, 0);
    PoseBundle exact(truth, matches), bundle(given, matches);
    exact.solve({1e-4, 1e-7}, kScale);
    bundle.solve(kNoise, kScale);
    const CommonPoseError error = bundle.common_error(kNoise, kScale);
    const auto motion = common_motion(exact.places_mm(), bundle.places_mm(), error.about_mm());
    found_mm2 += motion[2] * motion[2] / kSets;
    side_mm2 += motion.head<2>().squaredNorm() / kSets;
    const ByCommonErrors by = error.at(error.about_mm());
    const Eigen::Matrix3d covariance = by * by.transpose();
    expected_mm2 += covariance(2, 2) / kSets;
    expected_side_mm2 += covariance.topLeftCorner<2, 2>().trace() / kSets;
  }
  EXPECT_NEAR(std::sqrt(found_mm2 / expected_mm2), 1, 0.15) << found_mm2 << " of " << expected_mm2;
  EXPECT_NEAR(std::sqrt(side_mm2 / expected_side_mm2), 1, 0.15) << side_mm2 << " of " << expected_side_mm2;
  EXPECT_GT(std::sqrt(found_mm2), 3 * kNoise.eye_mm);
}

TEST(PoseBundle, FindsTheNoiseOfPosesFromNearlyOneSide) {
  constexpr PoseNoise kNoise{0.3, 0.05 * kDegree};
  constexpr int kSets = 20;
  const std::vector<PinholeView> truth = narrow_views();
  Noise noise;
  double eye = 0, angle = 0;
  for (int set = 0; set < kSets; ++set) {
    std::vector<PinholeView> given;
    for (const PinholeView& view : truth) given.push_back(noise.erring(view, kNoise));
    const auto adjusted = adjusted_poses(given, matches_of(truth, noise, 0.5, 0.1));
    ASSERT_TRUE(adjusted);
    eye += adjusted->poses.noise.eye_mm / kNoise.eye_mm / kSets;
    angle += adjusted->poses.noise.angle_rad / kNoise.angle_rad / kSets;
  }
  EXPECT_NEAR(eye, 1, 0.3);
  EXPECT_NEAR(angle, 1, 0.3);
}

/// Views that have such errors see a place off by them: without the errors, where it is.
TEST(CommonPoseError, ViewsWithoutItSeeAPlaceWhereItIs) {
  const std::vector<PinholeView> views = five_views();
  CommonErrors sigma;
  sigma << 0.6, 0.4, 1.6, 0.006, 0.008, 0.004, 0.012;
  const CommonPoseError common({5, 0, 0}, sigma.cwiseAbs2().asDiagonal());
  CommonErrors errors;
  errors << 1, -0.5, 0.8, -1.2, 0.6, 0.4, -0.9;
  const Eigen::Vector3d place_mm(20, -30, 10), off_mm = common.at(place_mm) * errors;
  EXPECT_GT(off_mm.norm(), 0.5);
  for (const PinholeView& view : views) {
    const PinholeView true_view = moved(view, common.without(errors, view));
    const auto seen = view.project(place_mm + off_mm), truly = true_view.project(place_mm);
    const auto as_given = view.project(place_mm);
    EXPECT_LT(std::hypot(seen.x_px - truly.x_px, seen.y_px - truly.y_px), 0.15);
    EXPECT_GT(std::hypot(seen.x_px - as_given.x_px, seen.y_px - as_given.y_px), 1);
  }
}

/// What poses err by that are exact, averaged, or of single records.
constexpr std::array kPoseNoises{PoseNoise{0, 0}, PoseNoise{0.7, 0.1 * kDegree}, PoseNoise{3, 0.5 * kDegree}};

std::vector<PinholeView> erring(const std::vector<PinholeView>& truth, const PoseNoise& by, Noise& noise) {
  std::vector<PinholeView> out;
  for (const PinholeView& view : truth) out.push_back(noise.erring(view, by));
  return out;
}

TEST(ViewAgreement, TellsAWrongFocalLengthFromPosesThatErr) {
  Noise noise;
  const std::vector<PinholeView> truth = five_views();
  for (const PoseNoise& of_poses : kPoseNoises) {
    for (const double share : {0.05, -0.07}) {
      std::vector<PinholeView> given = erring(truth, of_poses, noise);
      for (PinholeView& view : given) {
        view.fx_px *= 1 + share;
        view.fy_px *= 1 + share;
      }
      const auto found = view_agreement(given, matches_of(truth, noise, 0.4, 0.2));
      ASSERT_TRUE(found);
      EXPECT_NEAR(found->focal.share, share, 4 * found->focal.sigma) << of_poses.eye_mm;
      EXPECT_GT(std::abs(found->focal.share), 5 * found->focal.sigma) << of_poses.eye_mm;
    }
  }
}

TEST(ViewAgreement, AccusesNeitherLensNorViewWhereAllPosesErrAlike) {
  constexpr int kDraws = 4;
  Noise noise;
  const std::vector<PinholeView> truth = five_views();
  for (const PoseNoise& of_poses : kPoseNoises) {
    for (int draw = 0; draw < kDraws; ++draw) {
      const auto found = view_agreement(erring(truth, of_poses, noise), matches_of(truth, noise, 0.4, 0.2));
      ASSERT_TRUE(found);
      EXPECT_LT(std::abs(found->focal.share), 4 * found->focal.sigma) << of_poses.eye_mm;
      EXPECT_FALSE(found->odd) << of_poses.eye_mm << ": view " << found->odd->view;
    }
  }
}

TEST(ViewAgreement, NamesTheViewThatIsOffAlongItsLineOfSight) {
  constexpr double kOff_mm = 15;
  Noise noise;
  const std::vector<PinholeView> truth = five_views();
  for (const PoseNoise& of_poses : std::span(kPoseNoises).first(2)) {
    for (std::size_t n = 0; n < truth.size(); n += 2) {
      std::vector<PinholeView> given = erring(truth, of_poses, noise);
      const Transform<Camera, Patient>& pose = given[n].camera_from_patient;
      given[n] = moved(given[n], {pose.rotation(), Eigen::Vector3d(pose.translation().x(), pose.translation().y(),
                                                                   pose.translation().z() + kOff_mm)});
      const auto found = view_agreement(given, matches_of(truth, noise, 0.4, 0.2));
      ASSERT_TRUE(found && found->odd);
      EXPECT_EQ(found->odd->view, n);
      EXPECT_NEAR(found->odd->off.eye_mm, kOff_mm, 4) << of_poses.eye_mm;
      EXPECT_LT(found->odd->others.eye_mm, 2) << of_poses.eye_mm;
      EXPECT_LT(std::abs(found->focal.share), 5 * found->focal.sigma) << of_poses.eye_mm;
    }
  }
}

TEST(ViewAgreement, OfTwoViewsOrFewMatchesNamesNone) {
  Noise noise;
  std::vector<PinholeView> two = five_views();
  two.resize(2);
  std::vector<PinholeView> given = two;
  given[0] = noise.erring(given[0], {8, 0.01});
  const auto found = view_agreement(given, matches_of(two, noise, 0.4, 0));
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->odd);
  EXPECT_FALSE(view_agreement(given, std::vector<TextureMatch>{}));
}

}  // namespace
}  // namespace birdseye::host
