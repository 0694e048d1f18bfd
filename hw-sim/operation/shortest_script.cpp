#include "hw-sim/operation/shortest_script.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace birdseye::hw_sim {

namespace {

using OneFault = std::pair<FaultTarget, Fault>;

std::vector<OneFault> faults_of(const FaultScript& script) {
  std::vector<OneFault> out;
  for (const FaultTarget target : kFaultTargets)
    for (const Fault& fault : script.of(target)) out.emplace_back(target, fault);
  return out;
}

FaultScript script_of(const std::vector<OneFault>& faults) {
  FaultScript out;
  for (const auto& [target, fault] : faults) out.of(target).push_back(fault);
  return out;
}

}  // namespace

FaultScript shortest_script(const FaultScript& script, const std::function<bool(const FaultScript&)>& breaks) {
  std::vector<OneFault> faults = faults_of(script);
  for (std::size_t part = faults.size(); part >= 1; part /= 2) {
    for (std::size_t from = 0; from < faults.size();) {
      std::vector<OneFault> fewer = faults;
      const auto begin = fewer.begin() + static_cast<std::ptrdiff_t>(from);
      fewer.erase(begin, begin + static_cast<std::ptrdiff_t>(std::min(part, fewer.size() - from)));
      if (breaks(script_of(fewer))) {
        faults = std::move(fewer);
      } else {
        from += part;
      }
    }
  }
  return script_of(faults);
}

}  // namespace birdseye::hw_sim
