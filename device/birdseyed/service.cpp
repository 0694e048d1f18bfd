#include "device/birdseyed/service.hpp"

#include <fmt/format.h>
#include <systemd/sd-daemon.h>

#include "drivers/system/clock.hpp"

namespace birdseye::device {

void notify_ready(const std::string& status) {
  ::sd_notify(0, fmt::format("READY=1\nSTATUS={}", status).c_str());
}

void notify_status(const std::string& status) {
  ::sd_notify(0, fmt::format("STATUS={}", status).c_str());
}

void notify_reloading() {
  ::sd_notify(0, fmt::format("RELOADING=1\nMONOTONIC_USEC={}", device_now().ns / 1000).c_str());
}

void notify_stopping() {
  ::sd_notify(0, "STOPPING=1");
}

void notify_alive() {
  ::sd_notify(0, "WATCHDOG=1");
}

}  // namespace birdseye::device
