#pragma once

#include <spdlog/sinks/base_sink.h>
#include <unistd.h>

#include <algorithm>
#include <mutex>

#include "drivers/system/wait.hpp"

namespace birdseye::device {

/// The log on standard error. While the reader of standard error takes nothing (a full pipe, a journal that hangs),
/// lines are left out: instruments and clients do not wait for the log.
class PatientStderr final : public spdlog::sinks::base_sink<std::mutex> {
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    // A pipe that poll(2) calls ready takes at least so many bytes without waiting.
    constexpr std::size_t kAtOnce = 4096;
    if ((wait_ready(STDERR_FILENO, POLLOUT, Deadline::after({})) & POLLOUT) != 0)
      (void)!::write(STDERR_FILENO, line.data(), std::min(line.size(), kAtOnce));
  }
  void flush_() override {}
};

}  // namespace birdseye::device
