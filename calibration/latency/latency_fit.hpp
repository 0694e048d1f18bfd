#pragma once

#include <Eigen/Core>
#include <vector>

namespace birdseye::calibration {

/// How stream b follows from stream a, given an offset in time and a drift. Other unknowns (hand-eye and the like) are
/// the model's own state.
class TimingModel {
 public:
  /// What the model leaves of b, and how it changes: residual = observed - modelled, in `rows_per_sample` rows a
  /// sample, is nearly own * d_own + timing * (d_offset_s, d_drift).
  struct Linearised {
    Eigen::VectorXd residual;
    Eigen::MatrixXd own;
    Eigen::MatrixX2d timing;
  };
  virtual ~TimingModel() = default;
  [[nodiscard]] virtual Eigen::Index rows_per_sample() const = 0;
  /// Of b's samples, seconds from the time at which the offset holds.
  [[nodiscard]] virtual const std::vector<double>& times_s() const = 0;
  [[nodiscard]] virtual Linearised linearise(double offset_s, double drift) const = 0;
  virtual void take(const Eigen::VectorXd& d_own) = 0;

  TimingModel() = default;
  TimingModel(const TimingModel&) = delete;
  TimingModel& operator=(const TimingModel&) = delete;
};

struct TimingFit {
  double offset_s = 0, drift = 0;
  double offset_sigma_s = 0, drift_sigma = 0;
  double student95 = 0;  ///< how many sigmas the 95 % interval reaches, given the number of parts that sigma rests on
  double rms = 0;        ///< per row, of samples that are no outliers
  double outlier_share = 0;
  std::vector<double> losses;  ///< of each sample, the square of its residual: to compare two fits of the same samples
  std::vector<double> part_s, part_offset_s, part_sigma_s;  ///< by how much the offset of parts differs
};

/// Gauss-Newton with Huber's weights, starting at this offset. The sigmas are those of a jackknife over parts of a
/// second or more (linearised: Cameron, Gelbach, Miller 2008, the estimator called CR3), which assumes nothing about
/// noise but that parts are independent: residuals may be correlated within them.
TimingFit fit_timing(TimingModel& model, double offset_s, bool find_drift);

/// By how many standard errors of its mean over parts `other` fits worse than `best`.
double sigmas_worse(const TimingFit& best, const TimingFit& other, const std::vector<double>& times_s);

}  // namespace birdseye::calibration
