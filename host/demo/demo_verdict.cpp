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
  const char* unit;
  [[nodiscard]] Grade grade() const {  // a figure that is no number fails
    return value <= pass ? Grade::pass : value <= marginal ? Grade::marginal : Grade::fail;
  }
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
  const auto shown = static_cast<double>(mm.size());
  const double judged = shown + figures.frames_without_overlay, all = judged + figures.frames_unproven;
  const double unproven_percent = 100 * figures.frames_unproven / std::max(1.0, all);
  const double dropped_percent = 100.0 * figures.frames_dropped / std::max(1, figures.frames + figures.frames_dropped);
  std::vector<Limit> limits;
  if (mm.empty()) {
    const bool told = !figures.hidden_because.empty() || figures.frames_unproven + figures.frames_dropped > 0;
    out.add(Grade::fail, fmt::format("fail: no frame carried an overlay{}{}", mostly_because(figures),
                                     told ? "" : "; see birdseyed.log"));
  } else {
    const double p95_mm = percentile(mm, 0.95), worst_mm = *std::max_element(mm.begin(), mm.end());
    const double hidden_percent = 100 * figures.frames_without_overlay / judged;
    limits = {
        {p95_mm, kTargetLimits.pass_mm, kTargetLimits.marginal_mm,
         fmt::format("the tumour's centre is within {:.2f} mm in 95 % of the frames", p95_mm), "mm"},
        {worst_mm, 6, 10, fmt::format("the tumour's centre is off by {:.2f} mm in the worst frame", worst_mm), "mm"},
        {hidden_percent, 10, 50,
         fmt::format("{:.1f} % of the frames carry no overlay{}", hidden_percent, mostly_because(figures)), "%"}};
  }
  limits.push_back(
      {unproven_percent, 60, 80,
       fmt::format("{:.1f} % of the frames had to go by before the video had first shown that it goes with the poses",
                   unproven_percent),
       "%"});
  limits.push_back(
      {dropped_percent, 5, 20,
       fmt::format("{:.1f} % of the frames were dropped, for this machine is slow or busy", dropped_percent), "%"});
  for (const Limit& limit : limits) {
    const Grade grade = limit.grade();
    const bool headline = !mm.empty() && &limit == &limits.front();  // is said in any case
    if (grade == Grade::pass && !headline) continue;
    out.add(grade, fmt::format("{}: {}; up to {} {} pass", name_of(grade), limit.said, limit.pass, limit.unit));
  }
  if (figures.deforming && !figures.deforming->found)
    out.add(Grade::fail, "fail: the CT was not deformed: " + figures.deforming->words);
  return out;
}

}  // namespace birdseye::host
