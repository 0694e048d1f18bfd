#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/time/clock.hpp"
#include "drivers/system/process_copy.hpp"

namespace birdseye::host {

/// Sends bytes to the process that asked for the work.
using Send = ProcessCopy::Send;
/// Takes the next bytes that the work sends. False where they do not come: the work has ended, by a signal perhaps, or
/// is late.
using Receive = std::function<bool(void* to, std::size_t size)>;

/// Runs `work` in a copy of this process, and at the same time `take` in this process (ProcessCopy). For decoders of
/// files from elsewhere: Debian's GDCM meets damage with an assertion, which no catch can hold
/// (docs/decisions/0012-isolated-import.md). What take receives is not to be trusted. Whatever else uses those
/// decoders' libraries holds copies off meanwhile (CopiesHeldOff). The copy is killed where one receive of take waits
/// for longer than `silence`, or when take returns, or when stop is requested: work may take as long as it needs if it
/// sends meanwhile, and what take asks for is to be bounded. Errors: no process is free; and, where take asked for more
/// than came, how the copy ended: Errc::timeout or Errc::disconnected, in words that go on from "its decoder". For
/// files that a decoder is given by their path, run_confined_to does this and confines the copy.
Result<void> run_isolated(const std::function<void(const Send&)>& work, const std::function<void(const Receive&)>& take,
                          Duration silence, const std::stop_token& stop = {});

/// Receives `count` values. The count is only what the other process says, so memory is touched only as values come.
/// Empty where not all of them come.
template <typename T>
std::optional<std::vector<T>> receive_values(const Receive& receive, std::size_t count) {
  constexpr std::size_t kStep = (1U << 18U) / sizeof(T), kReserved = (1U << 30U) / sizeof(T);
  std::vector<T> values;
  values.reserve(std::min(count, kReserved));
  while (values.size() < count) {
    const std::size_t had = values.size(), more = std::min(count - had, kStep);
    values.resize(had + more);
    if (!receive(values.data() + had, more * sizeof(T))) return std::nullopt;
  }
  return values;
}

}  // namespace birdseye::host
