#include "host/bench/factor_summary.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "calibration/base/median.hpp"
#include "host/report/line_plot.hpp"

namespace birdseye::host {

namespace {

using nlohmann::json;

constexpr const char* kKinds[] = {"seen_by_two", "seen", "seen_moved", "hidden", "inside"};

/// A number of trial.kinds.<kind>, where it is there.
struct Numbers {
  std::vector<double> before_mm, after_mm;
  /// What was predicted and what was, root mean squares.
  std::vector<std::pair<double, double>> said_and_true_mm;
};

Numbers numbers_of(const std::vector<json>& trials, const char* kind) {
  Numbers out;
  for (const json& trial : trials) {
    const json& kinds = trial["kinds"];
    if (!kinds.contains(kind)) continue;
    const json& one = kinds[kind];
    const double before_mm = one["before"]["mean_mm"];
    out.before_mm.push_back(before_mm);
    out.after_mm.push_back(one.contains("after") ? one["after"]["mean_mm"].get<double>() : before_mm);
    if (one.contains("predicted") && one.contains("after"))
      out.said_and_true_mm.emplace_back(one["predicted"]["rms_mm"], one["after"]["rms_mm"]);
  }
  return out;
}

using Pairs = std::vector<std::pair<double, double>>;

/// Root mean squares of both.
std::pair<double, double> rms_of(Pairs::const_iterator begin, Pairs::const_iterator end) {
  double first = 0, second = 0;
  for (auto pair = begin; pair != end; ++pair) {
    first += pair->first * pair->first;
    second += pair->second * pair->second;
  }
  const auto count = static_cast<double>(end - begin);
  return {std::sqrt(first / count), std::sqrt(second / count)};
}

/// The least value that 95 of 100 do not exceed.
double percentile95(std::vector<double> values) {
  constexpr double kShare = 0.95;
  std::sort(values.begin(), values.end());
  const auto rank = static_cast<std::size_t>(std::ceil(kShare * static_cast<double>(values.size())));
  return values[std::max<std::size_t>(rank, 1) - 1];
}

double median_over(const std::vector<json>& trials, const char* key) {
  std::vector<double> values;
  for (const json& trial : trials) {
    if (trial.contains(key)) values.push_back(trial[key]);
  }
  return median_of(std::move(values));
}

bool passes(const json& trial) {
  return trial["grade"] == "pass";
}

bool outside(const json& trial) {
  return trial["target"].contains("outside") && trial["target"]["outside"].get<bool>();
}

/// Of each trial that failed or passed wrongly: which, and why.
json told_of(const std::vector<json>& trials) {
  json out = json::array();
  for (const json& trial : trials) {
    const int seed = trial["seed"];
    if (trial.contains("error")) {
      out.push_back(fmt::format("seed {}: error: {}", seed, trial["error"].get<std::string>()));
    } else if (trial["grade"] == "fail") {
      out.push_back(fmt::format("seed {}: fail: {}", seed, trial["reason"].get<std::string>()));
    } else if (passes(trial) && outside(trial)) {
      out.push_back(fmt::format("seed {}: passes with its target {:.1f} mm off, outside of {:.1f} mm", seed,
                                trial["target"]["error_mm"].get<double>(),
                                trial["target"]["predicted"]["radius95_mm"].get<double>()));
    }
  }
  return out;
}

/// A number of a row to two digits; nothing where it is not there.
std::string cell(const json& row, const char* key) {
  return row.contains(key) ? fmt::format("{:.2f}", row[key].get<double>()) : "";
}

}  // namespace

std::string line_of(const json& trial) {
  const std::string which = fmt::format("{}, seed {}", trial["class"].get<std::string>(), trial["seed"].get<int>());
  if (trial.contains("refused")) return fmt::format("{}: refused: {}", which, trial["refused"].get<std::string>());
  std::string line = fmt::format("{}, {}:", which, trial["optimiser"].get<std::string>());
  if (trial.contains("error")) return fmt::format("{} error: {}", line, trial["error"].get<std::string>());
  for (const char* kind : kKinds) {
    if (!trial["kinds"].contains(kind)) continue;
    const json& one = trial["kinds"][kind];
    line += fmt::format(" {} {:.2f} to {:.2f},", kind, one["before"]["mean_mm"].get<double>(),
                        one["after"]["mean_mm"].get<double>());
  }
  line += fmt::format(" target {:.2f} mm", trial["target"]["error_mm"].get<double>());
  if (trial["target"].contains("predicted"))
    line += fmt::format(" (95 %: {:.2f})", trial["target"]["predicted"]["radius95_mm"].get<double>());
  return fmt::format("{}, {}, {:.1f} processor s", line, trial["grade"].get<std::string>(),
                     trial["processor_s"].get<double>());
}

json factor_row(const std::string& name, const std::string& optimiser, const std::vector<json>& trials) {
  json row{{"class", name}, {"optimiser", optimiser}, {"trials", trials.size()}};
  if (trials.empty()) return row;
  for (const char* kind : kKinds) {
    const Numbers numbers = numbers_of(trials, kind);
    if (numbers.before_mm.empty()) continue;
    row[fmt::format("{}_before_mm", kind)] = median_of(numbers.before_mm);
    row[fmt::format("{}_after_mm", kind)] = median_of(numbers.after_mm);
    if (numbers.said_and_true_mm.empty()) continue;
    const auto [said_mm, true_mm] = rms_of(numbers.said_and_true_mm.begin(), numbers.said_and_true_mm.end());
    row[fmt::format("{}_predicted_rms_mm", kind)] = said_mm;
    row[fmt::format("{}_actual_rms_mm", kind)] = true_mm;
    row[fmt::format("{}_predicted_over_actual", kind)] = said_mm / true_mm;
  }
  const auto count = static_cast<double>(trials.size());
  const auto share = [&](const auto& which) {
    return static_cast<double>(std::count_if(trials.begin(), trials.end(), which)) / count;
  };
  row["errors"] = std::count_if(trials.begin(), trials.end(), [](const json& t) { return t.contains("error"); });
  row["pass_share"] = share(passes);
  row["marginal_share"] = share([](const json& t) { return t["grade"] == "marginal"; });
  row["target_outside_share"] = share(outside);
  row["pass_outside_share"] = share([](const json& t) { return passes(t) && outside(t); });
  std::vector<double> circle_mm, error_mm;
  for (const json& trial : trials) {
    if (!passes(trial) || !trial["target"].contains("predicted")) continue;
    circle_mm.push_back(trial["target"]["predicted"]["radius95_mm"]);
    error_mm.push_back(trial["target"]["error_mm"]);
  }
  if (!circle_mm.empty()) {
    row["circle_of_passes_mm"] = median_of(circle_mm);
    row["error_of_passes_p95_mm"] = percentile95(error_mm);
    row["circle_over_error_p95"] = median_of(circle_mm) / percentile95(error_mm);
  }
  for (const char* key : {"processor_s", "registration_s", "generation_s", "stereo_points"})
    row[key] = median_over(trials, key);
  row["told"] = told_of(trials);
  return row;
}

std::string factor_markdown(const json& rows) {
  std::string text =
      "| class | optimiser | trials | errors | seen, mm | hidden, mm | inside, mm | predicted / actual: seen | hidden "
      "| "
      "inside | pass | pass, target outside | circle / error's 95 % | processor s |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  std::string told;
  for (const json& row : rows) {
    const auto name = row["class"].get<std::string>(), optimiser = row["optimiser"].get<std::string>();
    if (row["trials"] == 0) continue;
    const auto from_to = [&](const char* kind) {
      const std::string before = fmt::format("{}_before_mm", kind), after = fmt::format("{}_after_mm", kind);
      return row.contains(before) ? cell(row, before.c_str()) + " to " + cell(row, after.c_str()) : "";
    };
    text += fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {:.0f} % | {:.0f} % | {} | {:.1f} |\n",
                        name, optimiser, row["trials"].get<int>(), row["errors"].get<int>(), from_to("seen"),
                        from_to("hidden"), from_to("inside"), cell(row, "seen_predicted_over_actual"),
                        cell(row, "hidden_predicted_over_actual"), cell(row, "inside_predicted_over_actual"),
                        100 * row["pass_share"].get<double>(), 100 * row["pass_outside_share"].get<double>(),
                        cell(row, "circle_over_error_p95"), row["processor_s"].get<double>());
    for (const json& line : row["told"])
      told += fmt::format("- {}, {}, {}\n", name, optimiser, line.get<std::string>());
  }
  return told.empty() ? text : text + "\n" + told;
}

std::string calibration_svg(const std::vector<json>& trials) {
  constexpr std::size_t kBins = 8;  // more would not be drawn as dots
  Panel panel{"Error predicted and error left, root mean square", "predicted, mm", "left, mm", {}};
  double most_mm = 0;
  for (const char* kind : {"seen", "hidden", "inside"}) {
    Pairs pairs = numbers_of(trials, kind).said_and_true_mm;
    std::sort(pairs.begin(), pairs.end());
    const std::size_t bins = std::min(kBins, pairs.size());
    Curve curve{kind, {}};
    for (std::size_t bin = 0; bin < bins; ++bin) {
      const auto at = [&](std::size_t b) {
        return pairs.begin() + static_cast<std::ptrdiff_t>(b * pairs.size() / bins);
      };
      curve.points.push_back(rms_of(at(bin), at(bin + 1)));
      most_mm = std::max(most_mm, curve.points.back().first);
    }
    if (!curve.points.empty()) panel.curves.push_back(std::move(curve));
  }
  panel.curves.push_back({"as predicted", {{0, 0}, {most_mm, most_mm}}});
  return plot_svg({panel}, 1);
}

}  // namespace birdseye::host
