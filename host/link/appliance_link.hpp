#pragma once

#include <memory>
#include <string>

#include "device/wire/client.hpp"

namespace birdseye::host {

constexpr int kUsualPort = 18944;

/// Where an appliance or another OpenIGTLink server is: "HOST:PORT", or "HOST" for the usual port. "plain:" before it
/// asks for no TLS.
struct ServerAddress {
  std::string host;
  int port = 0;
  bool plain = false;

  static Result<ServerAddress> parse(const std::string& text, int usual_port = kUsualPort);
  [[nodiscard]] std::string name() const;
};

/// Connects to an appliance, or to another OpenIGTLink server. To one on another machine by TLS, to a key that is known
/// here, unless the address says plain. Waits some seconds for a server that is starting; the error names the address
/// and what to look at.
Result<std::unique_ptr<wire::Client>> connect_appliance(const std::string& address,
                                                        const wire::ForeignSettings& foreign = {});

}  // namespace birdseye::host
