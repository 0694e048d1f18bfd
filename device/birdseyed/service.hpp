#pragma once

#include <string>

namespace birdseye::device {

/// Tells the service manager, where there is one. See sd_notify(3).
void notify_ready(const std::string& status);
void notify_status(const std::string& status);
void notify_reloading();
void notify_stopping();
void notify_alive();

}  // namespace birdseye::device
