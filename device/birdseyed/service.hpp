#pragma once

#include <string>

namespace birdseye::device {

/// What the service manager is told; nothing where there is none. See sd_notify(3).
void notify_ready(const std::string& status);
void notify_status(const std::string& status);
void notify_reloading();
void notify_stopping();
void notify_alive();

}  // namespace birdseye::device
