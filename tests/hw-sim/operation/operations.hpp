#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "hw-sim/operation/operation.hpp"

/// Operations that a test runs, and faults that it has them meet.
namespace birdseye::hw_sim {

inline constexpr std::uint64_t kSeedAtBoard = 5;  // whose scope has yet to be calibrated

inline OperationOutcome operate(const SimulatedOperation& operation) {
  auto out = run_operation(operation);
  EXPECT_TRUE(out) << out.error().what;
  return out ? *std::move(out) : OperationOutcome{};
}

inline std::string told(const OperationOutcome& out) {
  std::string text;
  for (const BrokenLaw& law : out.broken) text += law.law + ": " + law.what + "\n";
  return text + out.log;
}

inline Fault usual(FaultKind kind, double at_s, double for_s, std::map<std::string, double, std::less<>> values = {}) {
  return {kind, at_s, for_s, std::move(values)};
}

inline FaultScript programs_end(std::vector<Fault> faults) {
  FaultScript script;
  script.programs = std::move(faults);
  return script;
}

}  // namespace birdseye::hw_sim
