// What an error of the lens does to places that views show, and to the error that is to be expected.
#include "host/registration/geometry/lens_error.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <array>
#include <random>

#include "calibration/geometry/rotations.hpp"
#include "host/registration/geometry/displacement_fit.hpp"
#include "host/registration/geometry/pinhole_view.hpp"
#include "tests/support/ball.hpp"

namespace birdseye::host {
namespace {

using Eigen::Vector3d;

CameraModel bent_lens() {
  CameraModel camera;
  camera.width_px = 768;
  camera.height_px = 576;
  camera.fx_px = camera.fy_px = 700;
  camera.cx_px = 390;
  camera.cy_px = 280;
  camera.k1 = -0.2;
  camera.p1 = 0.002;
  return camera;
}

/// Focal length to 1 %, which both axes share, the centre to 3 px, the bend to 0.02.
CameraMatrix lens_covariance() {
  CameraVector sigma;
  sigma << 7, 7, 3, 3, 0.02, 0, 0, 0, 0;
  CameraMatrix out = CameraMatrix(sigma.cwiseAbs2().asDiagonal());
  out(0, 1) = out(1, 0) = 0.98 * 49;
  return out;
}

/// From 150 mm in front of the patient, turned about the origin.
PinholeView from(double turn_rad, double tilt_rad, const std::shared_ptr<const LensError>& error) {
  PinholeView out;
  Eigen::Matrix3d upright;
  upright << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const Eigen::Matrix3d turn = upright * rotation_exp(Vector3d(tilt_rad, 0, turn_rad));
  out.camera_from_patient = {turn, Vector3d(0, 0, 150)};
  out.eye_in_patient_mm = out.camera_from_patient.inverse().translation();
  out.lens_error = error;
  return out;
}

std::shared_ptr<const LensError> error_of(const CameraModel& camera, const CameraMatrix& covariance) {
  const std::optional<CameraMatrix> known(covariance);
  return lens_errors(std::array{camera}, std::array{known}).front();
}

CameraModel off_by(CameraModel camera, const CameraVector& step) {
  const CameraVector moved = parameters_of(camera) + step;
  set_parameters(camera, moved.data());
  return camera;
}

/// Where the views find a place that one lens shows, if they take it for another.
Vector3d found_place(const Vector3d& place_mm, std::span<const PinholeView* const> views, const CameraModel& truth,
                     const CameraModel& taken) {
  Vector3d found_mm = place_mm;
  for (int step = 0; step < 8; ++step) {
    Eigen::MatrixX3d rows(2 * static_cast<Eigen::Index>(views.size()), 3);
    Eigen::VectorXd wanted(rows.rows());
    for (std::size_t n = 0; n < views.size(); ++n) {
      const auto& camera_from_patient = views[n]->camera_from_patient;
      const Eigen::Vector2d seen_px = *project(truth, camera_from_patient * place_mm);
      const Vector3d ray = *unproject(taken, seen_px), at_mm = camera_from_patient * found_mm;
      Eigen::Matrix<double, 2, 3> by_camera;
      by_camera << Eigen::Matrix2d::Identity(), -at_mm.hnormalized();
      rows.middleRows<2>(2 * static_cast<Eigen::Index>(n)) = by_camera / at_mm.z() * camera_from_patient.rotation();
      wanted.segment<2>(2 * static_cast<Eigen::Index>(n)) = ray.head<2>() - at_mm.hnormalized();
    }
    found_mm += rows.completeOrthogonalDecomposition().solve(wanted);
  }
  return found_mm;
}

TEST(LensError, MovesAPlaceAsTriangulationByTheOtherLensDoes) {
  const CameraModel taken = bent_lens();
  const CameraMatrix covariance = lens_covariance();
  const auto error = error_of(taken, covariance);
  const PinholeView left = from(-0.3, 0.1, error), right = from(0.25, -0.2, error);
  const std::array both{&left, &right};
  const Vector3d place_mm(12, -20, 9);
  // Summed over the independent errors, as over the parameters by small steps.
  const ByLensErrors by = by_lens_errors(place_mm, both);
  Eigen::Matrix<double, 3, 9> slopes;
  for (int k = 0; k < 9; ++k) {
    const double step = 1e-4 * (k < 4 ? 100 : 1);
    // The truth differs from what is taken: what is found is moved back by as much.
    slopes.col(k) = (found_place(place_mm, both, taken, off_by(taken, step * CameraVector::Unit(k))) - place_mm) / step;
  }
  const Eigen::Matrix3d expected = slopes * covariance * slopes.transpose(), stated = by * by.transpose();
  EXPECT_LT((stated - expected).norm(), 0.01 * expected.norm());
  EXPECT_GT(std::sqrt(expected.trace()), 0.3) << "mm: worth counting";
}

TEST(LensError, OfASingleViewDoesNotReachAlongItsLineOfSight) {
  const PinholeView view = from(0.2, 0.1, error_of(bent_lens(), lens_covariance()));
  const Vector3d place_mm(10, -15, 20), sight = (place_mm - view.eye_in_patient_mm).normalized();
  const ByLensErrors by = by_lens_errors(place_mm, std::array{&view});
  EXPECT_LT((sight.transpose() * by).norm(), 1e-9);
  EXPECT_GT(by.norm(), 0.3);
}

TEST(LensError, IsSharedByViewsOfOneLensAndByNoOthers) {
  CameraModel other = bent_lens();
  other.cx_px += 1;
  const std::optional<CameraMatrix> known(lens_covariance()), unknown;
  const auto errors = lens_errors(std::array{bent_lens(), other, bent_lens()}, std::array{known, known, known});
  EXPECT_EQ(errors[0], errors[2]);
  EXPECT_NE(errors[0], errors[1]);
  const Eigen::Matrix2Xd one = errors[0]->directions_by({0.1, 0.2}), two = errors[1]->directions_by({0.1, 0.2});
  EXPECT_EQ(one.cols(), 10) << "five each: what is not solved for has no error";
  EXPECT_EQ(one.cwiseAbs().cwiseProduct(two.cwiseAbs()).norm(), 0);
  const auto half = lens_errors(std::array{bent_lens(), other}, std::array{known, unknown});
  EXPECT_EQ(half[1]->directions_by({0.1, 0.2}).norm(), 0) << "taken for exact";
  EXPECT_EQ(half[1]->errors_of_all(), 5);
}

TEST(LensError, ThatIsNotKnownIsNone) {
  const std::optional<CameraMatrix> unknown;
  EXPECT_EQ(lens_errors(std::array{bent_lens()}, {}).front(), nullptr);
  EXPECT_EQ(lens_errors(std::array{bent_lens()}, std::array{unknown}).front(), nullptr);
  const PinholeView view = from(0, 0, nullptr);
  EXPECT_EQ(by_lens_errors({0, 0, 0}, std::array{&view}).cols(), 0);
}

/// Places of a ball that did not move, as three views in front of it find them by a lens that is off by a draw of its
/// covariance.
struct SeenByAWrongLens {
  std::vector<SeenPoint> points;
  explicit SeenByAWrongLens(unsigned seed, double ball_mm, bool lens_known) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    const CameraMatrix covariance = lens_covariance();
    CameraVector draw = CameraVector::NullaryExpr([&](Eigen::Index) { return normal(random); });
    const double of_focus = draw[0];
    draw = draw.cwiseProduct(covariance.diagonal().cwiseSqrt());
    draw[1] = 7 * (0.98 * of_focus + 0.199 * draw[1] / 7);
    const CameraModel taken = bent_lens(), truth = off_by(taken, draw);
    const auto error = lens_known ? error_of(taken, covariance) : nullptr;
    const std::array views{from(-0.35, 0, error), from(0.35, 0.1, error), from(0, -0.35, error)};
    const std::array all{&views[0], &views[1], &views[2]};
    while (points.size() < 120) {
      const Vector3d outwards = Vector3d(normal(random), normal(random), normal(random)).normalized();
      if (outwards.y() > -0.5) continue;
      const Vector3d found_mm = found_place(ball_mm * outwards, all, truth, taken);
      points.push_back({found_mm + 0.15 * normal(random) * outwards, 0.15, std::nullopt});
      points.back().by_lens_mm = by_lens_errors(points.back().place_mm, all);
    }
  }
};

/// Over draws, root mean square of the surface's error, over what was to be expected of it.
double actual_over_expected(bool lens_known) {
  constexpr double kLensBall_mm = 40;
  constexpr std::array kAnnealed_mm{4.0, 2.0, 1.0, 0.5};
  const SignedDistance organ = testing::ball(kLensBall_mm);
  DisplacementPrior prior;
  prior.parts = {{80, 4}};
  double off_mm2 = 0, expected_mm2 = 0;
  for (unsigned seed = 1; seed <= 24; ++seed) {
    const SeenByAWrongLens seen(seed, kLensBall_mm, lens_known);
    const DisplacementFit fit = DisplacementFit::solve(organ, seen.points, prior, nullptr, kAnnealed_mm);
    // Across the surface, where places tell of it: elsewhere the prior's own error hides that of the lens.
    for (const Vector3d& outwards :
         {Vector3d(0.6, -0.8, 0), Vector3d(-0.6, -0.8, 0), Vector3d(0, -0.8, 0.6), Vector3d(0, -0.8, -0.6)}) {
      const Vector3d place_mm = kLensBall_mm * outwards;
      off_mm2 += std::pow(outwards.dot(fit.seen_field(organ).at(place_mm)), 2);
      expected_mm2 += outwards.dot(fit.covariance(place_mm, place_mm) * outwards);
    }
  }
  return std::sqrt(off_mm2 / expected_mm2);
}

TEST(LensError, IsInTheErrorThatIsToBeExpected) {
  const double known = actual_over_expected(true), unknown = actual_over_expected(false);
  EXPECT_GT(known, 0.5);
  EXPECT_LT(known, 1.4);
  EXPECT_GT(unknown, 1.7 * known) << "taken for exact, the lens misleads";
}

TEST(LensError, OfNothingChangesNothing) {
  constexpr std::array kAnnealed_mm{4.0, 2.0, 1.0, 0.5};
  const SignedDistance organ = testing::ball(40);
  DisplacementPrior prior;
  prior.parts = {{80, 4}};
  std::vector<SeenPoint> points = SeenByAWrongLens(3, 40, false).points;
  const DisplacementFit without = DisplacementFit::solve(organ, points, prior, nullptr, kAnnealed_mm);
  for (SeenPoint& point : points) point.by_lens_mm = ByLensErrors::Zero(3, 5);
  const DisplacementFit with = DisplacementFit::solve(organ, points, prior, nullptr, kAnnealed_mm);
  EXPECT_NEAR(without.log_evidence(), with.log_evidence(), 1e-9);
  EXPECT_LT((without.covariance({0, -20, 0}, {0, -20, 0}) - with.covariance({0, -20, 0}, {0, -20, 0})).norm(), 1e-9);
}

}  // namespace
}  // namespace birdseye::host
