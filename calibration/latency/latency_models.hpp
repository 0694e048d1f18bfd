#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "calibration/latency/latency.hpp"
#include "calibration/latency/latency_fit.hpp"
#include "calibration/latency/motion_spline.hpp"
#include "calibration/latency/motion_stream.hpp"

namespace birdseye::calibration {

/// base_b_from_body_b(t) = turn_of_bases * base_a_from_body_a(t - offset - drift t) * a_from_b, of rotations. Compared
/// is how the bodies stand, not how fast they turn, so that nothing need be differentiated.
class RotationTiming final : public TimingModel {
 public:
  /// b_from_a: of the bodies, near enough. The samples of b must be covered by a at offset_s.
  RotationTiming(const MotionSpline& a, MotionSamples b, const Eigen::Matrix3d& b_from_a, double offset_s);

  [[nodiscard]] Eigen::Index rows_per_sample() const override { return 3; }
  [[nodiscard]] const std::vector<double>& times_s() const override { return times_s_; }
  [[nodiscard]] Linearised linearise(double offset_s, double drift) const override;
  void take(const Eigen::VectorXd& d_own) override;
  [[nodiscard]] Eigen::Matrix3d b_from_a() const { return a_from_b_.transpose(); }

 private:
  const MotionSpline& a_;
  MotionSamples b_;
  std::vector<double> times_s_;
  Eigen::Matrix3d a_from_b_, turn_of_bases_;
};

/// motion of the picture = map (4x6) * the body's turn and shift in its own axes, between the same two times by a's
/// clock. Both sides are summed up from picture to picture, forgetting within half a second. From one picture to the
/// next the tracker's noise is not small beside the hand's motion, and least squares would take the noise for a weak
/// response, which in several axes at once looks like a shift in time. Summed up, the noise is no larger than in the
/// poses.
class ImageTiming final : public TimingModel {
 public:
  ImageTiming(const MotionSpline& a, std::vector<ImageMotion> b, double offset_s);

  [[nodiscard]] Eigen::Index rows_per_sample() const override { return 4; }
  [[nodiscard]] const std::vector<double>& times_s() const override { return times_s_; }
  [[nodiscard]] Linearised linearise(double offset_s, double drift) const override;
  void take(const Eigen::VectorXd& d_own) override;
  /// What the map makes of a's motion at b's samples, px/s.
  [[nodiscard]] std::vector<double> modelled_speeds(double offset_s, double drift) const;

 private:
  using Step = Eigen::Matrix<double, 6, 1>;
  [[nodiscard]] Step step(const ImageMotion& of, double offset_s, double drift) const;
  void sum_up(Eigen::MatrixXd& rows, Eigen::Index per_sample) const;

  const MotionSpline& a_;
  std::vector<ImageMotion> b_;
  std::vector<double> times_s_;
  Eigen::Matrix<double, 4, 6> map_;
};

}  // namespace birdseye::calibration
