#include "device/wire/refusal_log.hpp"

#include <fmt/format.h>

namespace birdseye::wire {

void RefusalLog::note(const std::string& host, const std::string& why, DeviceTime now) {
  if (!tell_) return;
  OfOneReason& reason = untold_[why];
  ++reason.count;
  reason.last_host = host;
  tell_due(now);
}

void RefusalLog::tell_due(DeviceTime now) {
  if (untold_.empty() || now < lines_.free_at()) return;
  lines_.passed(now);
  std::uint64_t count = 0;
  std::string reasons;
  for (const auto& [why, reason] : untold_) {
    count += reason.count;
    reasons +=
        fmt::format("{}{} ({}, the last from {})", reasons.empty() ? "" : "; ", why, reason.count, reason.last_host);
  }
  if (count == 1) {
    tell_(fmt::format("a connection from {} was not let in: {}", untold_.begin()->second.last_host,
                      untold_.begin()->first));
  } else {
    tell_(fmt::format("{} more connections were not let in: {}", count, reasons));
  }
  untold_.clear();
}

}  // namespace birdseye::wire
