#pragma once

#include <filesystem>
#include <string>

namespace birdseye::drivers {

/// Asks the driver of an open serial port not to collect bytes, where it can be asked, and sets the latency timer of an
/// FTDI adapter (a file in the kernel's sysfs, named by timer) where it may be set. What cannot be is no error; the
/// text tells what is the case, for a log.
std::string lower_latency(int fd, const std::filesystem::path& timer, int timer_ms);

/// Where the kernel keeps the latency timer of that serial port, if it is one of FTDI's.
std::filesystem::path latency_timer_of(const std::filesystem::path& device);

}  // namespace birdseye::drivers
