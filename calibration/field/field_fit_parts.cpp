#include "calibration/field/field_fit_parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "calibration/base/median.hpp"
#include "calibration/base/units.hpp"
#include "calibration/field/field_levels.hpp"
#include "calibration/field/field_regression.hpp"

namespace birdseye::calibration {

namespace detail {

Result<FieldFunctions> box_of(std::span<const Eigen::Vector3d> places_mm) {
  FieldFunctions box;
  box.low_mm.setConstant(1e300);
  box.high_mm.setConstant(-1e300);
  for (const Eigen::Vector3d& p : places_mm) {
    if (!p.allFinite()) return Error{Errc::bad_value, "a position is not finite; take out the row it is in"};
    box.low_mm = box.low_mm.cwiseMin(p);
    box.high_mm = box.high_mm.cwiseMax(p);
  }
  const auto too_thin = [](const Eigen::Vector3d& size_mm, const char* along) {
    return Error{
        Errc::degenerate,
        fmt::format("the samples fill {:.0f} x {:.0f} x {:.0f} mm{}; a map needs {:.0f} mm along each axis, so "
                    "lift the board, or put it at more heights",
                    size_mm.x(), size_mm.y(), size_mm.z(), along, kThinnestBoxMm)};
  };
  const Eigen::Vector3d size_mm = box.high_mm - box.low_mm;
  if (!(size_mm.minCoeff() >= kThinnestBoxMm)) return too_thin(size_mm, "");
  // A board that is tilted fills a box and is thin all the same.
  const OwnBox own = own_box(places_mm);
  const Eigen::Vector3d own_mm = own.high_mm - own.low_mm;
  if (!(own_mm.minCoeff() >= kThinnestBoxMm)) return too_thin(own_mm, " along their own axes");
  return box;
}

std::vector<FieldFunctions> families(const FieldFunctions& box, std::span<const Eigen::Vector3d> places_mm,
                                     const std::optional<FieldBasis>& only, std::size_t most_functions) {
  std::vector<FieldFunctions> out;
  const auto offer = [&](FieldBasis basis, int order) {
    FieldFunctions functions = box;
    functions.basis = basis;
    functions.order = order;
    if (basis == FieldBasis::rbf) functions.centres_mm = spread_out(places_mm, static_cast<std::size_t>(order));
    const bool wanted = !only || *only == basis;
    if (wanted && functions.fault().empty() && functions.count() <= most_functions) out.push_back(std::move(functions));
  };
  for (int order = 1; order <= 4; ++order) offer(FieldBasis::polynomial, order);
  for (int order = 2; order <= 5; ++order) offer(FieldBasis::bernstein, order);
  for (const int centres : {20, 50, 100, 180}) offer(FieldBasis::rbf, centres);
  return out;
}

std::size_t best_of(std::span<const FieldCandidate> candidates, std::span<const FieldFunctions> functions) {
  constexpr double kAsGood = 1.02;
  const auto least = std::min_element(candidates.begin(), candidates.end(),
                                      [](const auto& a, const auto& b) { return a.held_out_mm < b.held_out_mm; });
  auto best = static_cast<std::size_t>(least - candidates.begin());
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (candidates[i].held_out_mm <= kAsGood * least->held_out_mm && functions[i].count() < functions[best].count())
      best = i;
  }
  return best;
}

std::vector<bool> far_off(std::span<const Eigen::Vector3d> errors_mm, const std::vector<bool>& used, double least_mm) {
  constexpr double kMedianSigmas = 1.538;
  std::vector<double> sizes;
  for (std::size_t i = 0; i < errors_mm.size(); ++i) {
    if (used[i]) sizes.push_back(errors_mm[i].norm());
  }
  const double limit_mm = std::max(least_mm, kOutlierSigmas * median_of(std::move(sizes)) / kMedianSigmas);
  std::vector<bool> far(errors_mm.size());
  for (std::size_t i = 0; i < errors_mm.size(); ++i) far[i] = !(errors_mm[i].norm() <= limit_mm);
  return far;
}

double rms(std::span<const Eigen::Vector3d> errors, const std::vector<bool>& used) {
  double squares = 0, count = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (!used[i]) continue;
    squares += errors[i].squaredNorm();
    ++count;
  }
  return count > 0 ? std::sqrt(squares / count) : 0;
}

void sum_up(FieldFit& fit) {
  double before = 0, after = 0, count = 0, within = 0;
  fit.before_worst_mm = fit.held_out_worst_mm = 0;
  for (const FieldResidual& r : fit.residuals) {
    if (r.outlier) continue;
    ++count;
    before += r.before_mm.squaredNorm();
    fit.before_worst_mm = std::max(fit.before_worst_mm, r.before_mm.norm());
    if (r.beyond) continue;
    ++within;
    after += r.held_out_mm.squaredNorm();
    if (r.held_out_mm.norm() >= fit.held_out_worst_mm) {
      fit.held_out_worst_mm = r.held_out_mm.norm();
      fit.worst = r.name;
    }
  }
  fit.before_mm = std::sqrt(before / std::max(1.0, count));
  fit.held_out_mm = std::sqrt(after / std::max(1.0, within));
}

void take_mapped(std::span<const Eigen::Vector3d> places_mm, FieldFit& fit) {
  constexpr double kMost = 0.95;
  const FieldMapData& data = fit.map.data();
  const OwnBox around = own_box(places_mm);
  std::vector<double> mapped;
  double nodes = 0;
  for (std::size_t node = 0; node < data.sigma_mm.size(); ++node) {
    if (!around.holds(place_of_node(data.functions, node))) continue;
    ++nodes;
    if (data.sigma_mm[node] >= 0) mapped.push_back(data.sigma_mm[node]);
  }
  fit.mapped_part = static_cast<double>(mapped.size()) / std::max(1.0, nodes);
  if (mapped.empty()) return;
  const auto at = mapped.begin() + static_cast<std::ptrdiff_t>(kMost * static_cast<double>(mapped.size() - 1));
  std::ranges::nth_element(mapped, at);
  fit.sigma95_mm = *at;
}

std::string unit_of(double mm_per_unit) {
  constexpr double kNear = 1.1;
  for (const auto& [unit_mm, name] : {std::pair{10.0, "cm"}, {kMmPerInch, "inches"}, {1000.0, "metres"}}) {
    if (mm_per_unit < unit_mm * kNear && mm_per_unit > unit_mm / kNear) return name;
  }
  return {};
}

}  // namespace detail

namespace {

// The error of the best published corrections of such trackers, and what an overlay may still be off by at all.
constexpr double kMapPassMm = 1.0, kMapMarginalMm = FieldMap::kMostSigmaMm;
// Pairs carry the noise of two sensors that move, and of their orientations.
constexpr double kPairPassMm = 2.0, kPairMarginalMm = 4.0;
// Metal bends a field, and stretches all of it by hardly a hundredth.
constexpr double kSoundScale = 0.02, kWorstScale = 0.05;
constexpr double kWorstFactor = 5;   // of the RMS; beyond it one region is not described by the map
constexpr double kLittleGain = 0.9;  // of the error before: the map takes away next to nothing
constexpr double kFewOutliers = 0.1, kManyOutliers = 0.25;
constexpr double kMostlyMapped = 0.6, kHardlyMapped = 0.1;  // of the box
// A place at the rim is known less well than those that were held out. Beyond FieldMap::kMostSigmaMm it is not mapped.
constexpr double kSigmaPassMm = 1.5;
constexpr double kLeastDirectionSpread = 0.02;  // a body that is turned by 30 deg about two axes has 0.06

/// Metal moves no level of a grid as a whole, and stretches hardly anything evenly: such is the board, or its table.
void judge_board(const FieldFit& fit, Verdict& verdict) {
  double worst = fit.scale - 1;
  int axis = -1;
  // An axis counts by itself where it is off by far more than all three together.
  for (int k = 0; k < 3; ++k) {
    if (std::abs(fit.stretch[k] - 1) <= 1.5 * std::abs(worst)) continue;
    worst = fit.stretch[k] - 1;
    axis = k;
  }
  const double limit = std::abs(worst) > kWorstScale ? kWorstScale : kSoundScale;
  std::string reason = fmt::format("by the tracker lengths are {:.1f} % {} than the grid has them",
                                   100 * std::abs(fit.scale - 1), fit.scale >= 1 ? "longer" : "shorter");
  if (axis >= 0 && std::abs(worst) > kSoundScale)
    reason += fmt::format(", along {} they are {:.1f} % {}", "xyz"[axis], 100 * std::abs(worst),
                          worst > 0 ? "longer" : "shorter");
  const bool sound = std::abs(worst) <= kSoundScale;
  verdict.add(sound                 ? Grade::pass
              : limit > kSoundScale ? Grade::fail
                                    : Grade::marginal,
              fmt::format("{}, {} {:.0f} %", reason, sound ? "of at most" : "more than", 100 * limit),
              sound ? ""
                    : "measure the grid's steps and the spacers' heights with a ruler: what they are wrong by is "
                      "mapped as if it were the field's");
  if (!fit.shifted_level) return;
  const ShiftedLevel& level = *fit.shifted_level;
  const Eigen::Vector3d& shift = level.shift_mm;
  verdict.add(
      Grade::fail,
      fmt::format("level {} of the grid ({} = {:.4g} mm) lies {:.1f} mm off the others, all its places alike: by "
                  "{:.1f}, {:.1f}, {:.1f} mm along x, y and z; metal moves no level as a whole",
                  level.level, "xyz"[level.axis], level.at_mm, shift.norm(), shift.x(), shift.y(), shift.z()),
      "see whether that level's coordinates are written down as they are: the spacer's height, the board moved "
      "sideways, a row counted twice");
}

void judge_distance(double stated_mm, double measured_mm, Verdict& verdict) {
  const double ratio = measured_mm / stated_mm, off = std::max(ratio, 1 / ratio) - 1;
  if (off <= kSoundScale) return;
  std::string step =
      "measure the distance between the sensors' centres again, and move metal away from the transmitter";
  if (const std::string unit = detail::unit_of(ratio); !unit.empty()) {
    step = fmt::format("--distance is in mm: {:.4g} seems to be in {}", stated_mm, unit);
  } else if (const std::string of_poses = detail::unit_of(1 / ratio); !of_poses.empty()) {
    step = fmt::format("the lengths of the poses seem to be in {}: say so with --unit", of_poses);
  }
  verdict.add(
      off > kWorstScale ? Grade::fail : Grade::marginal,
      fmt::format("the sensors are {:.1f} mm apart by the tracker (median), and {:.1f} mm by --distance; these may "
                  "differ by {:.0f} %",
                  measured_mm, stated_mm, 100 * (off > kWorstScale ? kWorstScale : kSoundScale)),
      step);
}

void judge_pairs(const FieldFit& fit, Verdict& verdict) {
  if (fit.direction_spread < kLeastDirectionSpread) {
    verdict.add(Grade::fail,
                fmt::format("the line between the sensors hardly turned (spread {:.3f}, at least {:.2f}): stretching "
                            "cannot be told from a longer body",
                            fit.direction_spread, kLeastDirectionSpread),
                "turn the body about all axes while it is moved through the volume");
  }
  if (fit.stated_distance_mm) {
    judge_distance(*fit.stated_distance_mm, fit.measured_distance_mm, verdict);
  } else {
    verdict.add(Grade::marginal, "the distance between the sensors is not given: the scale is left as it was measured",
                "measure the distance between the sensors' centres with a calliper and give it with --distance");
  }
}

/// The worst of these measurements by name, with how far off they are.
std::string named(std::vector<const FieldResidual*> residuals) {
  constexpr std::size_t kNamed = 8;
  std::ranges::stable_sort(residuals, std::ranges::greater(),
                           [](const FieldResidual* r) { return r->held_out_mm.norm(); });
  std::string names;
  for (std::size_t i = 0; i < std::min(kNamed, residuals.size()); ++i)
    names += fmt::format("{}{} ({:.1f} mm)", i == 0 ? "" : ", ", residuals[i]->name, residuals[i]->held_out_mm.norm());
  return residuals.size() > kNamed ? fmt::format("{} and {} more", names, residuals.size() - kNamed) : names;
}

void judge_outliers(const FieldFit& fit, Verdict& verdict) {
  std::vector<const FieldResidual*> all, bent;
  for (const FieldResidual& r : fit.residuals) {
    if (r.outlier) all.push_back(&r);
    if (r.beside_outlier) bent.push_back(&r);
  }
  if (all.empty()) return;
  const double part = static_cast<double>(all.size()) / static_cast<double>(fit.residuals.size());
  const bool few = part <= kFewOutliers;
  verdict.add(few                    ? Grade::pass
              : part > kManyOutliers ? Grade::fail
                                     : Grade::marginal,
              fmt::format("{} of {} measurements {} the rest: {}", all.size(), fit.residuals.size(),
                          all.size() == 1 ? "does not fit" : "do not fit", named(all)),
              "look whether the sensor was seated at the places that are named, and measure those again");
  if (bent.empty()) return;
  verdict.add(Grade::marginal,
              fmt::format("{} of them lie next to one another: the field bends there as the map cannot follow, so that "
                          "poses there are doubted: {}",
                          bent.size(), named(bent)),
              "move metal away from there, or measure around it in smaller steps");
}

}  // namespace

Verdict verdict_of(const FieldFit& fit) {
  Verdict verdict;
  verdict.judge(
      fit.from_pairs ? "held-out change of the body's length and direction" : "held-out error after correction",
      fit.held_out_mm, "mm", fit.from_pairs ? kPairPassMm : kMapPassMm,
      fit.from_pairs ? kPairMarginalMm : kMapMarginalMm,
      "average each place for longer, measure more places where the report's arrows are long, and move what "
      "metal can be moved away from the transmitter");
  const auto beyond = std::ranges::count_if(fit.residuals, [](const auto& r) { return r.beyond && !r.outlier; });
  if (beyond > 0) {
    verdict.add(Grade::pass, fmt::format("{} of {} places, at the volume's rim, are not counted in it: a map without "
                                         "them would be extrapolated",
                                         beyond, fit.residuals.size()));
  }
  if (fit.held_out_worst_mm > kWorstFactor * fit.held_out_mm) {
    verdict.add(Grade::marginal,
                fmt::format("{} is off by {:.1f} mm, more than {:.0f} times the rest", fit.worst, fit.held_out_worst_mm,
                            kWorstFactor),
                "measure again around the place that is named, in smaller steps");
  }
  if (fit.held_out_mm > kLittleGain * fit.before_mm) {
    verdict.add(Grade::marginal,
                fmt::format("the map takes next to nothing away: {:.2f} mm before, {:.2f} mm after", fit.before_mm,
                            fit.held_out_mm),
                "if the error before is small enough, work without a map");
  }
  judge_outliers(fit, verdict);
  if (fit.sigma95_mm) {
    verdict.judge("the map's own sigma, in 95 % of what is mapped,", *fit.sigma95_mm, "mm", kSigmaPassMm,
                  FieldMap::kMostSigmaMm, "measure more places, and at more levels, where poses will be");
  }
  if (fit.mapped_part < kMostlyMapped) {
    verdict.add(fit.mapped_part < kHardlyMapped ? Grade::fail : Grade::marginal,
                fmt::format("only {:.0f} % of the box around the samples is mapped: elsewhere nothing was measured "
                            "nearby, or the map is not sure to {:.1f} mm",
                            100 * fit.mapped_part, FieldMap::kMostSigmaMm),
                "measure where the report shows gaps: poses there will be doubted");
  }
  if (fit.from_pairs) {
    judge_pairs(fit, verdict);
  } else {
    judge_board(fit, verdict);
  }
  return verdict;
}

}  // namespace birdseye::calibration
