#pragma once

#include <functional>
#include <string>
#include <vector>

#include "drivers/system/clock.hpp"
#include "host/doctor/check.hpp"

namespace birdseye::host {

/// One thing to ask of the machine, and how long its answer may take.
struct Question {
  std::string area, name;
  Duration within = Duration::from_ms(5000);
  /// Owns all that it uses: where a driver hangs, it is let go and outlives who asks.
  std::function<std::vector<Check>()> ask;
};

/// The answers in order; told hears each as soon as it is there. What gives none in time, or throws, is "not known",
/// and the rest is asked all the same.
std::vector<Check> ask_all(const std::vector<Question>& questions, const std::function<void(const Check&)>& told = {});

}  // namespace birdseye::host
