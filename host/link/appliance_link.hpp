#pragma once

#include <memory>
#include <string>

#include "device/wire/client.hpp"

namespace birdseye::host {

/// Connects to an appliance, or to another OpenIGTLink server, named as "HOST:PORT", or as "HOST" for the usual port.
/// Waits some seconds for a server that is starting; the error names the address and what to look at.
Result<std::unique_ptr<wire::Client>> connect_appliance(const std::string& address,
                                                        const wire::ForeignSettings& foreign = {});

}  // namespace birdseye::host
