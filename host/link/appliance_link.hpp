#pragma once

#include <memory>
#include <string>

#include "device/wire/client.hpp"

namespace birdseye::host {

constexpr int kUsualPort = 18944;

/// Where an appliance or another OpenIGTLink server is: "HOST:PORT", or "HOST" for the usual port. "plain:" before it
/// asks for no TLS, "NAME@" for the machine that is known here by this name and no other.
struct ServerAddress {
  std::string host;
  int port = 0;
  bool plain = false;
  std::string machine = {};  ///< empty: any that is known here

  static Result<ServerAddress> parse(const std::string& text, int usual_port = kUsualPort);
  [[nodiscard]] std::string name() const;
};

/// Connects to an appliance, or to another OpenIGTLink server. To one on another machine by TLS, to a key that is known
/// here, and by the name that the address says, unless it says plain. Waits some seconds for a server that is starting;
/// the error names the address and what to look at.
Result<std::unique_ptr<wire::Client>> connect_appliance(const std::string& address,
                                                        const wire::ForeignSettings& foreign = {});

/// Who answers at the address, to be said wherever it is not asked for by name: "192.168.1.20:18944 is cart-1, by its
/// key". Empty where it has shown no key.
std::string answered_words(const std::string& address, const std::string& machine);

}  // namespace birdseye::host
