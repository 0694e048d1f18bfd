#pragma once

#include <cstdint>
#include <string>

#include "calibration/base/verdict.hpp"

namespace birdseye::host {

/// What this machine dropped of an appliance's stream, because it fell behind.
struct Drops {
  std::uint64_t frames = 0, others = 0;

  /// Empty where nothing was dropped.
  [[nodiscard]] std::string words() const;
  /// Adds them to the reasons, where there are any. Other messages, poses among them, make a result marginal: nothing
  /// else tells how many are missing. Frames alone do not: their numbers do, and who takes them judges by those.
  void tell(Verdict& verdict) const;
};

}  // namespace birdseye::host
