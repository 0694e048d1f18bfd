#include "calibration/base/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace birdseye {

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
  if (value <= pass_up_to) {
    add(Grade::pass, fmt::format("{} {:.2f} {}, of at most {:.2f}", figure, value, unit, pass_up_to));
  } else if (value <= marginal_up_to) {
    add(Grade::marginal, fmt::format("{} {:.2f} {}, more than {:.2f}", figure, value, unit, pass_up_to), next_step);
  } else {
    add(Grade::fail, fmt::format("{} {:.2f} {}, more than {:.2f}", figure, value, unit, marginal_up_to), next_step);
  }
}

}  // namespace birdseye
