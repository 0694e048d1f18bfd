#pragma once

#include <string>

#include "device/wire/link.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye::wire {

/// Over a stream socket that is connected and does not block.
std::unique_ptr<Link> link_over(UniqueFd connected);

/// Tries until the deadline: an appliance that is starting is not an error yet.
Result<std::unique_ptr<Link>> connect_tcp(const std::string& host, int port, Deadline deadline);

/// port 0 takes any that is free. A port in use is an error that names it and the setting.
Result<std::unique_ptr<Listener>> listen_tcp(const std::string& bind_address, int port);

}  // namespace birdseye::wire
