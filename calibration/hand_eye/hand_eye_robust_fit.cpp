#include "calibration/hand_eye/hand_eye_robust_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include "calibration/hand_eye/hand_eye_start.hpp"
#include "calibration/hand_eye/tracked_errors.hpp"

namespace birdseye::calibration {

namespace {

/// One station in so many may be taken for an outlier by chance.
constexpr double kOutlierChance = 1e-4;
constexpr std::size_t kFewest = 3;
/// One calibration in so many may lose a station by chance where it has few.
constexpr double kOddChance = 0.01;
constexpr std::size_t kFew = 40;

class RobustFitter {
 public:
  RobustFitter(const HandEyeInput& in, const ChainFreedom& freedom, HandEyeStations& stations, HandEyeResult& out)
      : in_(in), freedom_(freedom), stations_(stations), out_(out) {
    found_.summed = summed_of(stations_.used);
  }

  /// Fits with the outliers that it finds put aside, twice: the first may have hidden others, and closed forms do not
  /// bear them.
  bool fit_all() {
    for (int round = 0; round < 2; ++round) {
      const ChainState start = best_start();
      if (out_.start.empty()) return false;
      for (const PreparedStation& p : stations_.used)
        found_.fit.residuals.push_back(chain_residual(p.summed.chain, p.summed.camera_from_marker, start).value);
      found_.fit.state = start;
      for (int i = 0; i < 5; ++i) {
        found_.noise = in_.tracker_noise.value_or(TrackerNoise{});
        const TrackerNoise median = median_noise(found_.fit.residuals, freedom_);
        found_.noise.position_sigma_mm = std::max(found_.noise.position_sigma_mm, median.position_sigma_mm);
        found_.noise.angle_sigma_rad = std::max(found_.noise.angle_sigma_rad, median.angle_sigma_rad);
        found_.fit = fit_chain(found_.summed, found_.fit.state, found_.noise, freedom_, true);
        if (!found_.fit.converged) return false;
      }
      if (!drop_outliers()) break;
      found_.fit.residuals.clear();
    }
    if (in_.tracker_noise) {
      found_.noise = *in_.tracker_noise;
      found_.fit = fit_chain(found_.summed, found_.fit.state, found_.noise, freedom_, false);
    } else {
      found_.noise = estimate_noise(found_.summed, found_.fit, found_.noise, freedom_);
      out_.noise_estimated = true;
    }
    constexpr int kMostOdd = 3;  // more are no exceptions
    for (int n = 0; n < kMostOdd && out_.noise_estimated && drop_odd_one(); ++n)
      found_.noise = estimate_noise(found_.summed, found_.fit, found_.noise, freedom_);
    out_.tracker_noise = found_.noise;
    return found_.fit.converged;
  }

  [[nodiscard]] RobustFit take() { return std::move(found_); }

 private:
  /// Stations with a reason leave.
  void keep_only(const std::vector<std::string>& reasons) {
    std::vector<PreparedStation> kept;
    for (std::size_t i = 0; i < reasons.size(); ++i) {
      if (reasons[i].empty()) {
        kept.push_back(stations_.used[i]);
      } else {
        found_.outliers.push_back(stations_.used[i]);
        out_.stations[stations_.used[i].index].why_not = "outlier: " + reasons[i];
      }
    }
    stations_.used = std::move(kept);
    found_.summed = summed_of(stations_.used);
  }

  ChainState best_start() {
    out_.starts = closed_forms(found_.summed);
    ChainState best;
    double least = std::numeric_limits<double>::infinity();
    for (HandEyeStart& start : out_.starts) {
      if (!start.failed.empty()) continue;
      ChainState state;
      state.camera_from_sensor = start.camera_from_sensor;
      state.body_from_marker = body_from_marker_of(found_.summed, start.camera_from_sensor);
      start.score = tracked_score(stations_, in_.camera, state);
      if (start.score < least) {
        least = start.score;
        best = state;
        out_.start = start.method;
      }
    }
    return best;
  }

  bool drop_outliers() {
    const double limit = distance_limit(kOutlierChance, freedom_.of_residuals(found_.summed.size()));
    std::vector<std::string> reasons(stations_.used.size());
    std::size_t found = 0;
    for (std::size_t i = 0; i < stations_.used.size(); ++i) {
      const auto without = fit_without(found_.summed, std::span(&i, 1), found_.fit, found_.noise, freedom_, true);
      if (!without) continue;
      const double squared = distance_squared(found_.summed[i], *without, found_.noise, freedom_);
      if (squared <= limit) continue;
      out_.stations[stations_.used[i].index].distance_squared = squared;
      reasons[i] =
          fmt::format("off by {:.1f} sigmas, where chance allows {:.1f}", std::sqrt(squared), std::sqrt(limit));
      ++found;
    }
    if (found == 0 || stations_.used.size() - found < kFewest + 1) return false;
    keep_only(reasons);
    return true;
  }

  /// Of few stations one that is off makes the noise seem larger, and hides in it. So each is judged by the noise of
  /// the others alone, as an externally studentised residual (R. Cook and S. Weisberg, 1982). True if one was put
  /// aside.
  bool drop_odd_one() {
    const std::size_t count = found_.summed.size();
    if (count < kFewest + 2 || count > kFew) return false;
    // The noise is two variances, position's and angle's, each of which rests on half of the residuals and on what
    // estimate_noise adds: taken to rest on all, good stations were left out twice as often as kOddChance says.
    const double residuals = freedom_.of_residuals(count - 1);
    const double limit = distance_limit(kOddChance / static_cast<double>(count),
                                        std::min(residuals, residuals / 2 + kNoisePriorFreedom));
    std::vector<std::string> reasons(count);
    double farthest = limit;
    for (std::size_t i = 0; i < count; ++i) {
      std::vector<SummedStation> others = found_.summed;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
      ChainFit fit = found_.fit;
      const TrackerNoise noise = estimate_noise(others, fit, found_.noise, freedom_);
      if (!fit.converged) continue;
      const double squared = distance_squared(found_.summed[i], {fit.state, fit.covariance}, noise, freedom_);
      if (!(squared > farthest)) continue;
      farthest = squared;
      reasons.assign(count, "");
      reasons[i] = fmt::format("off by {:.1f} sigmas of the others, where chance allows {:.1f}", std::sqrt(squared),
                               std::sqrt(limit));
      out_.stations[stations_.used[i].index].distance_squared = squared;
    }
    if (!(farthest > limit)) return false;
    keep_only(reasons);
    return true;
  }

  const HandEyeInput& in_;
  const ChainFreedom& freedom_;
  HandEyeStations& stations_;
  HandEyeResult& out_;
  RobustFit found_;
};

}  // namespace

std::optional<RobustFit> fit_robustly(const HandEyeInput& in, const ChainFreedom& freedom, HandEyeStations& stations,
                                      HandEyeResult& out) {
  RobustFitter fitter(in, freedom, stations, out);
  if (!fitter.fit_all()) return std::nullopt;
  return fitter.take();
}

}  // namespace birdseye::calibration
