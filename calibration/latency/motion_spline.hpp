#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <vector>

namespace birdseye::calibration {

/// A uniform cubic B-spline through noisy samples of several channels, by least squares with Huber's weights. Knots
/// that are a few samples apart average noise without shifting anything in time.
class SmoothingSpline {
 public:
  /// times_s: sorted, at least two; values: one row a sample, one column a channel.
  SmoothingSpline(std::span<const double> times_s, const Eigen::MatrixXd& values, double spacing_s);

  [[nodiscard]] Eigen::VectorXd at(double time_s) const { return combine(time_s, 0); }
  [[nodiscard]] Eigen::VectorXd slope_at(double time_s) const { return combine(time_s, 1); }  ///< per second

 private:
  [[nodiscard]] Eigen::VectorXd combine(double time_s, int derivative) const;

  double begin_s_, spacing_s_;
  Eigen::MatrixXd coefficients_;
};

/// A body's motion as a smooth function of time, from poses that are noisy.
class MotionSpline {
 public:
  struct Sample {
    double time_s = 0;
    Eigen::Quaterniond base_from_body = Eigen::Quaterniond::Identity();
    Eigen::Vector3d origin_in_base = Eigen::Vector3d::Zero();
  };
  explicit MotionSpline(std::span<const Sample> samples);

  /// Samples lie close enough on both sides.
  [[nodiscard]] bool covers(double time_s, double margin_s) const;
  [[nodiscard]] Eigen::Quaterniond rotation_at(double time_s) const;
  /// In the body's axes, rad/s.
  [[nodiscard]] Eigen::Vector3d turn_rate_at(double time_s) const;
  [[nodiscard]] Eigen::Vector3d origin_at(double time_s) const;
  /// How the body turns and shifts between two times, both in its own axes at half time: rad and the unit of places.
  [[nodiscard]] Eigen::Matrix<double, 6, 1> step(double from_s, double to_s) const;

 private:
  std::vector<double> times_s_;
  double most_gap_s_;
  std::optional<SmoothingSpline> quaternions_, origins_;
};

}  // namespace birdseye::calibration
