#include "host/registration/point_matching.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>

namespace birdseye::host {

Result<MatchedFit> match_and_fit(std::span<const Eigen::Vector3d> ct_in_patient_mm,
                                 std::span<const Eigen::Vector3d> touched_in_tracker_mm) {
  constexpr std::size_t kMost = 8;       // 40320 orders
  constexpr double kClearlyBetter = 3;   // the second best order must be worse than the best by this factor,
  constexpr double kClearlyWorseMm = 5;  // or by this much
  const std::size_t n = ct_in_patient_mm.size();
  if (n != touched_in_tracker_mm.size() || n > kMost) {
    return Error{Errc::bad_value,
                 fmt::format("{} markers found in the CT, {} touched on the patient: there must be as many, "
                             "at most {}",
                             n, touched_in_tracker_mm.size(), kMost)};
  }
  // Distances between points do not change with the frame: most orders fall to them before anything is fitted.
  const auto mismatch = [&](const std::vector<std::size_t>& order) {
    double worst = 0;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) {
        const double touched = (touched_in_tracker_mm[i] - touched_in_tracker_mm[j]).norm();
        const double found = (ct_in_patient_mm[order[i]] - ct_in_patient_mm[order[j]]).norm();
        worst = std::max(worst, std::abs(touched - found));
      }
    }
    return worst;
  };
  std::vector<std::size_t> order(n), best_order;
  std::iota(order.begin(), order.end(), std::size_t{0});
  double best = std::numeric_limits<double>::max();
  double second = best;
  do {
    const double here = mismatch(order);
    if (here < best) {
      second = std::exchange(best, here);
      best_order = order;
    } else {
      second = std::min(second, here);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  if (n >= 3 && second < std::max(kClearlyBetter * best, best + kClearlyWorseMm)) {
    return Error{Errc::degenerate,
                 fmt::format("the markers cannot be told apart by their distances ({:.1f} against {:.1f} mm): "
                             "place them less evenly",
                             best, second)};
  }
  std::vector<Eigen::Vector3d> ct;
  ct.reserve(n);
  for (const std::size_t i : best_order) ct.push_back(ct_in_patient_mm[i]);
  auto fit = calibration::fit_points<Patient, Tracker>(ct, touched_in_tracker_mm);
  if (!fit) return fit.error();
  return MatchedFit{*std::move(fit), std::move(best_order)};
}

}  // namespace birdseye::host
