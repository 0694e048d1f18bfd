#include "calibration/latency/latency_models.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

constexpr double kMmScale = 0.01;  // a hundred mm weigh as one rad where unknowns are kept small
constexpr double kForgetS = 0.5;   // hands turn to and fro faster than this, and errors that add up are slower

}  // namespace

RotationTiming::RotationTiming(const MotionSpline& a, MotionSamples b, const Eigen::Matrix3d& b_from_a, double offset_s)
    : a_(a), b_(std::move(b)), a_from_b_(b_from_a.transpose()) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const MotionSpline::Sample& sample : b_) {
    times_s_.push_back(sample.time_s);
    sum += sample.base_from_body.toRotationMatrix() *
           (a_.rotation_at(sample.time_s - offset_s).toRotationMatrix() * a_from_b_).transpose();
  }
  turn_of_bases_ = nearest_rotation(sum);
}

TimingModel::Linearised RotationTiming::linearise(double offset_s, double drift) const {
  const auto rows = 3 * static_cast<Eigen::Index>(b_.size());
  Linearised at{Eigen::VectorXd(rows), Eigen::MatrixXd(rows, 6), Eigen::MatrixX2d(rows, 2)};
  for (std::size_t i = 0; i < b_.size(); ++i) {
    const auto row = 3 * static_cast<Eigen::Index>(i);
    const double t = b_[i].time_s, t_a = t - offset_s - drift * t;
    const Eigen::Matrix3d here = a_.rotation_at(t_a).toRotationMatrix() * a_from_b_;
    at.residual.segment<3>(row) =
        rotation_log((turn_of_bases_ * here).transpose() * b_[i].base_from_body.toRotationMatrix());
    // A small turn after a_from_b, after the bases, or as the body goes on turning, each as b's body sees it.
    at.own.block<3, 3>(row, 0).setIdentity();
    at.own.block<3, 3>(row, 3) = here.transpose();
    const Eigen::Vector3d rate = a_from_b_.transpose() * a_.turn_rate_at(t_a);
    at.timing.block<3, 1>(row, 0) = -rate;
    at.timing.block<3, 1>(row, 1) = -rate * t;
  }
  return at;
}

void RotationTiming::take(const Eigen::VectorXd& d_own) {
  a_from_b_ = a_from_b_ * rotation_exp(d_own.head<3>());
  turn_of_bases_ = turn_of_bases_ * rotation_exp(d_own.tail<3>());
}

ImageTiming::ImageTiming(const MotionSpline& a, std::vector<ImageMotion> b, double offset_s) : a_(a), b_(std::move(b)) {
  const auto rows = static_cast<Eigen::Index>(b_.size());
  Eigen::MatrixXd steps(rows, 6), seen(rows, 4);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const ImageMotion& sample = b_[static_cast<std::size_t>(i)];
    times_s_.push_back(0.5 * (sample.from_s + sample.to_s));
    steps.row(i) = step(sample, offset_s, 0);
    seen.row(i) = sample.motion_px;
  }
  sum_up(steps, 1);
  sum_up(seen, 1);
  map_ = solve_least_norm(steps, seen).transpose();
}

ImageTiming::Step ImageTiming::step(const ImageMotion& of, double offset_s, double drift) const {
  Step step = a_.step(of.from_s - offset_s - drift * of.from_s, of.to_s - offset_s - drift * of.to_s);
  step.tail<3>() *= kMmScale;
  return step;
}

void ImageTiming::sum_up(Eigen::MatrixXd& rows, Eigen::Index per_sample) const {
  for (std::size_t i = 1; i < b_.size(); ++i) {
    const bool follows = b_[i].from_s == b_[i - 1].to_s;  // otherwise pictures are missing in between
    if (!follows) continue;
    const double kept = std::exp(-(b_[i].to_s - b_[i - 1].to_s) / kForgetS);
    const auto row = per_sample * static_cast<Eigen::Index>(i);
    rows.middleRows(row, per_sample) += kept * rows.middleRows(row - per_sample, per_sample);
  }
}

TimingModel::Linearised ImageTiming::linearise(double offset_s, double drift) const {
  const auto rows = 4 * static_cast<Eigen::Index>(b_.size());
  // Residual, own, timing.
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(rows, 27);
  constexpr double kNudgeS = 1e-3;
  for (std::size_t i = 0; i < b_.size(); ++i) {
    const auto row = 4 * static_cast<Eigen::Index>(i);
    const Step here = step(b_[i], offset_s, drift);
    all.block<4, 1>(row, 0) = b_[i].motion_px - map_ * here;
    for (Eigen::Index k = 0; k < 4; ++k) all.block<1, 6>(row + k, 1 + 6 * k) = here.transpose();
    const Step later = step(b_[i], offset_s + kNudgeS, drift), sooner = step(b_[i], offset_s - kNudgeS, drift);
    all.block<4, 1>(row, 25) = map_ * (later - sooner) / (2 * kNudgeS);
    all.block<4, 1>(row, 26) = all.block<4, 1>(row, 25) * times_s_[i];
  }
  sum_up(all, 4);
  return {all.col(0), all.middleCols(1, 24), all.rightCols<2>()};
}

void ImageTiming::take(const Eigen::VectorXd& d_own) {
  for (Eigen::Index k = 0; k < 4; ++k) map_.row(k) += d_own.segment<6>(6 * k).transpose();
}

std::vector<double> ImageTiming::modelled_speeds(double offset_s, double drift) const {
  constexpr std::size_t kToEachSide = 2;  // pictures, over which a tracker's noise is averaged for the eye
  std::vector<Eigen::Vector4d> rates;
  for (const ImageMotion& sample : b_)
    rates.emplace_back(map_ * step(sample, offset_s, drift) / (sample.to_s - sample.from_s));
  std::vector<double> speeds;
  for (std::size_t i = 0; i < rates.size(); ++i) {
    const std::size_t first = i - std::min(i, kToEachSide), last = std::min(i + kToEachSide, rates.size() - 1);
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (std::size_t k = first; k <= last; ++k) sum += rates[k];
    speeds.push_back(sum.norm() / static_cast<double>(last - first + 1));
  }
  return speeds;
}

}  // namespace birdseye::calibration
