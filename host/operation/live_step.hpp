#pragma once

#include <cstddef>
#include <string>

namespace birdseye::host {

/// The workflow, in its order.
enum class LiveStep { connect, calibrate, fiducials, views, deform, check, run };
inline constexpr std::size_t kLiveSteps = 7;
const char* name_of(LiveStep step);

/// How a step stands.
struct StepNote {
  bool done = false;
  std::string line;        ///< in words, for the workflow's side
  std::string doubt = {};  ///< what speaks now against what was found; empty: nothing
  /// It was found, and nothing speaks against it.
  [[nodiscard]] bool holds() const { return done && doubt.empty(); }
};

}  // namespace birdseye::host
