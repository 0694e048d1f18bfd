#include "host/demo/demo_verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

namespace birdseye::host {

namespace {

/// A figure with the limits up to which it passes and is marginal.
struct Limit {
  double value, pass, marginal;
  std::string said;  ///< of the value
};

/// What hid the overlay in most frames.
std::string mostly_because(const DemoFigures& figures) {
  const auto most = std::max_element(figures.hidden_because.begin(), figures.hidden_because.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == figures.hidden_because.end() ? "" : fmt::format(" (mostly: {})", most->first);
}

}  // namespace

Verdict demo_verdict(const DemoFigures& figures) {
  Verdict out;
  std::vector<double> mm;
  for (const FrameError& error : figures.errors) mm.push_back(error.target_mm);
  if (mm.empty()) {
    out.add(Grade::fail, fmt::format("no frame carried an overlay{}; see birdseyed.log", mostly_because(figures)));
    return out;
  }
  const double worst_mm = *std::max_element(mm.begin(), mm.end());
  const double p95_mm = percentile(mm, 0.95);
  const auto shown = static_cast<double>(mm.size());
  const double hidden_percent = 100 * figures.frames_without_overlay / (shown + figures.frames_without_overlay);
  const double unproven_percent =
      100 * figures.frames_unproven / (shown + figures.frames_without_overlay + figures.frames_unproven);
  const double dropped_percent = 100.0 * figures.frames_dropped / std::max(1, figures.frames + figures.frames_dropped);
  const Limit limits[] = {
      {p95_mm, kTargetLimits.pass_mm, kTargetLimits.marginal_mm,
       fmt::format("the tumour's centre is within {:.2f} mm in 95 % of the frames", p95_mm)},
      {worst_mm, 6, 10, fmt::format("the tumour's centre is off by {:.2f} mm in the worst frame", worst_mm)},
      {hidden_percent, 10, 50,
       fmt::format("{:.0f} % of the frames carry no overlay{}", hidden_percent, mostly_because(figures))},
      {unproven_percent, 60, 80,
       fmt::format("{:.0f} % of the frames had to go by before the video had shown that it goes with the poses",
                   unproven_percent)},
      {dropped_percent, 5, 20, fmt::format("{:.0f} % of the frames were dropped", dropped_percent)},
  };
  out.add(Grade::pass, fmt::format("{}; {} mm pass", limits[0].said, limits[0].pass));
  if (figures.deforming && !figures.deforming->found)
    out.add(Grade::fail, "the CT was not deformed: " + figures.deforming->words);
  for (const Limit& limit : limits) {
    if (limit.value <= limit.pass) continue;
    const bool said = &limit == &limits[0];
    out.add(limit.value <= limit.marginal ? Grade::marginal : Grade::fail,
            said ? "" : fmt::format("{}; {} pass", limit.said, limit.pass));
  }
  return out;
}

}  // namespace birdseye::host
