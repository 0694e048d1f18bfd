#include "calibration/base/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace birdseye {

namespace {

/// A figure beside its limit, each in words. A limit below 0.01 shows two digits of its own, and a figure above a limit
/// another number than that.
struct Compared {
  std::string value, limit;
};
Compared compared(double value, double limit) {
  constexpr int kMostDigits = 9;
  int digits = 2;
  if (limit > 0 && limit < 0.01) digits = std::min(kMostDigits, 1 - static_cast<int>(std::floor(std::log10(limit))));
  for (;; ++digits) {
    Compared out{fmt::format("{:.{}f}", value, digits), fmt::format("{:.{}f}", limit, digits)};
    if (!(value > limit) || out.value != out.limit || digits >= kMostDigits) return out;
  }
}

}  // namespace

const char* name_of(Grade grade) {
  switch (grade) {
    case Grade::pass:
      return "pass";
    case Grade::marginal:
      return "marginal";
    case Grade::fail:
      return "fail";
  }
  return "fail";
}

void Verdict::add(Grade found, std::string reason, std::string next_step) {
  grade = std::max(grade, found);
  if (!reason.empty()) reasons.push_back(std::move(reason));
  const bool new_step = std::find(next_steps.begin(), next_steps.end(), next_step) == next_steps.end();
  if (!next_step.empty() && new_step) next_steps.push_back(std::move(next_step));
}

void Verdict::judge(const std::string& figure, double value, const std::string& unit, double pass_up_to,
                    double marginal_up_to, const std::string& next_step) {
  // Written so that a figure that is no number fails.
  const Grade found = value <= pass_up_to ? Grade::pass : value <= marginal_up_to ? Grade::marginal : Grade::fail;
  const Compared said = compared(value, found == Grade::fail ? marginal_up_to : pass_up_to);
  const char* const than = found == Grade::pass ? "of at most" : "more than";
  add(found, fmt::format("{} {} {}, {} {}", figure, said.value, unit, than, said.limit),
      found == Grade::pass ? std::string() : next_step);
}

}  // namespace birdseye
