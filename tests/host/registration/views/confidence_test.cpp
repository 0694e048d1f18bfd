#include "host/registration/views/confidence.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

namespace birdseye::host {
namespace {

/// A value of -x^T curvature x / 2, and a surface of one point that x moves.
Summit quadratic(const Eigen::Matrix3d& curvature, double moved_per_mm = 1) {
  Summit summit;
  summit.coordinates = 3;
  summit.gradient = [curvature](const std::vector<double>& x) {
    const Eigen::Vector3d g = -curvature * Eigen::Vector3d(x[0], x[1], x[2]);
    return std::vector<double>{g.x(), g.y(), g.z()};
  };
  summit.surface_moves = [moved_per_mm](const std::vector<double>& x) {
    std::vector<float> out;
    for (const double v : x) out.push_back(static_cast<float>(moved_per_mm * v));
    return out;
  };
  return summit;
}

Eigen::Matrix3d diagonal(double a, double b, double c) {
  return Eigen::Vector3d(a, b, c).asDiagonal();
}

TEST(ExpectedError, FallsWithTheRootOfTheCurvature) {
  const double wide = expected_error_mm(quadratic(diagonal(0.1, 0.1, 0.1)));
  EXPECT_NEAR(expected_error_mm(quadratic(diagonal(0.4, 0.4, 0.4))), wide / 2, 1e-4 * wide);
}

TEST(ExpectedError, AddsTheAxesSquares) {
  const double a = expected_error_mm(quadratic(diagonal(0.1, 0.1, 0.1))) / std::sqrt(3.0);
  const double mixed = expected_error_mm(quadratic(diagonal(0.1, 0.4, 0.9)));
  EXPECT_NEAR(mixed, a * std::sqrt(1 + 1.0 / 4 + 1.0 / 9), 1e-4 * mixed);
}

TEST(ExpectedError, DoesNotDependOnTheCoordinatesDirections) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  const Eigen::Matrix3d curvature = diagonal(0.1, 0.02, 0.5);
  const double straight = expected_error_mm(quadratic(curvature));
  EXPECT_NEAR(expected_error_mm(quadratic(turn * curvature * turn.transpose())), straight, 1e-4 * straight);
}

TEST(ExpectedError, GrowsWithWhatTheSurfaceMoves) {
  const Eigen::Matrix3d curvature = diagonal(0.1, 0.02, 0.5);
  EXPECT_NEAR(expected_error_mm(quadratic(curvature, 2)), 2 * expected_error_mm(quadratic(curvature)), 1e-4);
}

TEST(ExpectedError, IsBoundedWhereTheViewsSayNothingButLargerThanAnywhereElse) {
  const double known = expected_error_mm(quadratic(diagonal(0.1, 0.1, 0.1)));
  const double flat = expected_error_mm(quadratic(diagonal(0.1, 0.1, 0)));
  EXPECT_GT(flat, 1.5);  // millimetres: about what an organ moves
  EXPECT_LT(flat, 3);
  EXPECT_GT(flat, 5 * known);
  // A saddle, where a registration was stopped early, tells no more than a plain.
  EXPECT_NEAR(expected_error_mm(quadratic(diagonal(0.1, 0.1, -0.3))), flat, 1e-4);
}

}  // namespace
}  // namespace birdseye::host
