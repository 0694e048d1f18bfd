#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/time/clock.hpp"

namespace birdseye::host {

/// What work in a process of its own came to.
struct IsolatedOutcome {
  std::vector<std::uint8_t> bytes;  ///< all that it sent
  bool ended_well = false;          ///< false: it was killed by a signal, or by the deadline
};

/// Runs work in a copy of this process, whose output goes nowhere and whose death is not ours. For decoders of files
/// from elsewhere: Debian's GDCM meets damage with an assertion, which no catch can hold
/// (docs/decisions/0012-isolated-import.md). work is given send(data, size). It must not use threads of ours; it is
/// killed at the deadline.
Result<IsolatedOutcome> run_isolated(
    const std::function<void(const std::function<void(const void* data, std::size_t size)>& send)>& work,
    Duration within);

}  // namespace birdseye::host
