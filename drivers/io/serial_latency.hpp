#pragma once

#include <filesystem>
#include <string>

namespace birdseye::drivers {

/// Asks the driver of an open serial port not to collect bytes, and sets the latency timer of an FTDI adapter (the file
/// `timer` of the kernel's sysfs). Where the driver cannot be asked, or the timer may not be set, that is no error: the
/// returned text tells the log what was achieved.
std::string lower_latency(int fd, const std::filesystem::path& timer, int timer_ms);

/// The file in which the kernel keeps the latency timer of this serial port, if an FTDI adapter is behind it.
std::filesystem::path latency_timer_of(const std::filesystem::path& device);

}  // namespace birdseye::drivers
