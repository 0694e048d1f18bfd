#include "calibration/field/field_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "calibration/field/field_fit_parts.hpp"
#include "calibration/points/point_fit.hpp"

namespace birdseye::calibration {

namespace {

constexpr std::size_t kFewestPlaces = 4;  // three fit rigidly whatever they are
constexpr double kMovingRange = 1.128;    // the mean range of two values, in sigmas
// A pointer is put into a divot no better than this: smaller sigmas of a few lucky days would cry wolf.
constexpr double kLeastSigmaMm = 0.05, kLeastSigmaPercent = 0.02;
// Whatever the history says: an overlay is off by at least as much.
constexpr double kPlatePassMm = 1.5, kPlateMarginalMm = 3.0;
constexpr std::size_t kRun = 8;
constexpr double kOnTheLine = 1e-6;  // what rounding makes of a value that is the mean is on neither side of it
constexpr const char* kLook =
    "look for metal that came near the transmitter (a table, a drill, a monitor), move it, and check again; if it has "
    "to "
    "stay, map the field anew";

ControlLimits limits_of(const std::vector<double>& values, double least_sigma) {
  const auto days = static_cast<double>(kLearningDays);
  const double mean = std::accumulate(values.begin(), values.begin() + kLearningDays, 0.0) / days;
  double ranges = 0;
  for (std::size_t i = 1; i < static_cast<std::size_t>(kLearningDays); ++i)
    ranges += std::abs(values[i] - values[i - 1]);
  return {mean, std::max(least_sigma, ranges / (days - 1) / kMovingRange), kLearningDays};
}

std::vector<double> column(std::span<const FieldCheck> history, double FieldCheck::*value) {
  std::vector<double> out;
  for (const FieldCheck& day : history) out.push_back(day.*value);
  return out;
}

/// Of the last `count` values, how many are beyond `sigmas` on one side.
int beyond(const std::vector<double>& values, const ControlLimits& limits, std::size_t count, double sigmas, int side) {
  if (values.size() < count) return 0;
  return static_cast<int>(std::count_if(values.end() - static_cast<std::ptrdiff_t>(count), values.end(), [&](double v) {
    return side * (v - limits.mean) > (sigmas + kOnTheLine) * limits.sigma;
  }));
}

struct Charted {
  const char* what;
  const char* unit;
  bool lower_is_better;
};

void run_rules(const std::vector<double>& values, const ControlLimits& limits, const Charted& of, Verdict& verdict) {
  const double last = values.back();
  for (const int side : {1, -1}) {
    if (side < 0 && of.lower_is_better) continue;
    const char* where = side > 0 ? "above" : "below";
    if (beyond(values, limits, 1, 3, side) == 1) {
      verdict.add(Grade::fail,
                  fmt::format("{} {:.2f} {} is more than 3 sigma {} the usual {:.2f} (limit {:.2f})", of.what, last,
                              of.unit, where, limits.mean, limits.mean + side * 3 * limits.sigma),
                  kLook);
    } else if (beyond(values, limits, 1, 2, side) == 1 && beyond(values, limits, 3, 2, side) >= 2) {
      verdict.add(Grade::marginal,
                  fmt::format("{} {:.2f} {}: two of the last three are more than 2 sigma {} the usual {:.2f}", of.what,
                              last, of.unit, where, limits.mean),
                  kLook);
    }
    if (beyond(values, limits, kRun, 0, side) == static_cast<int>(kRun)) {
      verdict.add(Grade::marginal,
                  fmt::format("{}: the last {} are all {} the usual {:.2f} {}: something changed and stayed", of.what,
                              kRun, where, limits.mean, of.unit),
                  kLook);
    }
  }
}

}  // namespace

Result<FieldCheck> check_field(const std::string& when, std::span<const CheckedPlace> places) {
  if (places.size() < kFewestPlaces)
    return Error{Errc::degenerate, fmt::format("{} places; a check needs {} at least, spread over the plate",
                                               places.size(), kFewestPlaces)};
  std::vector<Eigen::Vector3d> to, from;
  Eigen::Vector3d to_mean = Eigen::Vector3d::Zero(), from_mean = Eigen::Vector3d::Zero();
  for (const CheckedPlace& place : places) {
    to.push_back(place.measured_mm);
    from.push_back(place.true_mm);
    to_mean += place.measured_mm / static_cast<double>(places.size());
    from_mean += place.true_mm / static_cast<double>(places.size());
  }
  const auto fit = detail::fit_rigid(to, from);
  if (!fit) return fit.error();
  FieldCheck check;
  check.when = when;
  double squares = 0, along = 0, arms = 0, spread = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Eigen::Vector3d arm = fit->rotation * (from[i] - from_mean);
    const double off = (to[i] - to_mean - arm).norm();
    check.off_mm.push_back(off);
    squares += off * off;
    along += arm.dot(to[i] - to_mean);
    arms += arm.squaredNorm();
    spread += (to[i] - to_mean).squaredNorm();
    if (off >= check.worst_mm) {
      check.worst_mm = off;
      check.worst_place = places[i].name;
    }
  }
  // Of another unit alone: touches in the wrong order shrink the fit too, but do not make it good.
  constexpr double kGoodFit = 0.02;
  const double ratio = along / arms, left = spread - along * along / arms;
  for (const bool of_plate : {false, true}) {
    const std::string unit = detail::unit_of(of_plate ? ratio : 1 / ratio);
    if (unit.empty() || left > kGoodFit * spread) continue;
    return Error{
        Errc::bad_value,
        fmt::format("the places are {:.4g} times as far apart by the tracker as on the plate: {} seem to be in "
                    "{}; give both in mm",
                    ratio, of_plate ? "the plate's" : "those that were measured", unit)};
  }
  check.rms_mm = std::sqrt(squares / static_cast<double>(places.size()));
  check.scale_percent = 100 * (ratio - 1);
  return check;
}

std::optional<ControlChart> control_chart(std::span<const FieldCheck> history) {
  // A day that failed is not what is usual: it would widen the limits for good.
  std::vector<FieldCheck> sound;
  std::copy_if(history.begin(), history.end(), std::back_inserter(sound),
               [](const FieldCheck& day) { return day.rms_mm <= kPlateMarginalMm; });
  if (sound.size() < static_cast<std::size_t>(kLearningDays)) return std::nullopt;
  return ControlChart{limits_of(column(sound, &FieldCheck::rms_mm), kLeastSigmaMm),
                      limits_of(column(sound, &FieldCheck::scale_percent), kLeastSigmaPercent)};
}

Verdict verdict_of(std::span<const FieldCheck> history) {
  Verdict verdict;
  if (history.empty()) {
    verdict.add(Grade::fail, "nothing was measured", "touch the plate's places with the pointer");
    return verdict;
  }
  const FieldCheck& today = history.back();
  verdict.judge("error of the plate's places", today.rms_mm, "mm", kPlatePassMm, kPlateMarginalMm,
                fmt::format("touch {} again; if it stays, {}", today.worst_place, kLook));
  const auto chart = control_chart(history.first(history.size() - 1));
  if (!chart) {
    verdict.add(Grade::pass, fmt::format("day {} of {} that say what is usual: only the absolute limit is looked at",
                                         history.size(), kLearningDays));
    return verdict;
  }
  run_rules(column(history, &FieldCheck::rms_mm), chart->rms_mm, {"error of the plate's places", "mm", true}, verdict);
  run_rules(column(history, &FieldCheck::scale_percent), chart->scale_percent,
            {"the tracker's scale against the plate", "%", false}, verdict);
  return verdict;
}

}  // namespace birdseye::calibration
