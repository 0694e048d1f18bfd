#pragma once

#include <string>
#include <vector>

namespace birdseye {

/// What a result is good for: pass, use it; marginal, use it knowing why it is not better; fail, do not use it.
enum class Grade { pass, marginal, fail };

const char* name_of(Grade grade);

/// A grade, what it rests on and what to do about it, in words for the person who holds the scope.
struct Verdict {
  Grade grade = Grade::pass;
  std::vector<std::string> reasons;     ///< each names the figure and its limit
  std::vector<std::string> next_steps;  ///< what would make it better, most useful first

  /// Adds a finding. The grade becomes the worst of all findings. The reason is kept; the next step too, unless it is
  /// empty or was added before.
  void add(Grade found, std::string reason, std::string next_step = {});
  /// Adds a figure judged by two limits: above pass_up_to it is marginal, above marginal_up_to (or not finite) a fail.
  /// The reason is made from the figure: "held-out error 1.20 px, of at most 1.00". next_step is kept unless the figure
  /// passes.
  void judge(const std::string& figure, double value, const std::string& unit, double pass_up_to, double marginal_up_to,
             const std::string& next_step);
};

}  // namespace birdseye
