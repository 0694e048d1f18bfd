#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "calibration/geometry/linear_algebra.hpp"

namespace birdseye {
namespace {

TEST(IsCovariance, EachProductOfAMatrixWithItsTransposeIsOneWhateverTheUnits) {
  std::mt19937 rng(1);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 1000; ++trial) {
    const int rank = 1 + trial % 6;
    Eigen::MatrixXd root(6, rank);
    for (double& one : root.reshaped()) one = normal(rng);
    for (int row = 0; row < 6; ++row) root.row(row) *= std::pow(10.0, (row * 5 + trial) % 7 - 4);
    EXPECT_TRUE(is_covariance(root * root.transpose())) << trial;
  }
}

TEST(IsCovariance, WhatMeasurementsCannotHaveIsNone) {
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(4, 4);
  EXPECT_TRUE(is_covariance(one));
  EXPECT_TRUE(is_covariance(Eigen::MatrixXd::Zero(4, 4)));
  const auto with = [&one](Eigen::Index i, Eigen::Index j, double value) {
    Eigen::MatrixXd out = one;
    out(i, j) = out(j, i) = value;
    return out;
  };
  for (const double value :
       {-1e-9, -1.0, 1e12, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
    EXPECT_FALSE(is_covariance(with(2, 2, value))) << value;
  EXPECT_TRUE(is_covariance(with(0, 1, 1)));
  EXPECT_FALSE(is_covariance(with(0, 1, 1.001)));
  EXPECT_TRUE(is_covariance(with(2, 2, 0))) << "a parameter that was held";
  Eigen::MatrixXd held = with(2, 2, 0);
  held(1, 2) = held(2, 1) = 1e-3;
  EXPECT_FALSE(is_covariance(held)) << "and goes with another";
  Eigen::MatrixXd lopsided = one;
  lopsided(0, 1) = 0.5;
  EXPECT_FALSE(is_covariance(lopsided));
}

}  // namespace
}  // namespace birdseye
