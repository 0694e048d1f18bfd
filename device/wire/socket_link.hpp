#pragma once

#include "device/wire/link.hpp"

namespace birdseye::wire {

/// A link over a socket, for whoever waits for several of them at once. What a link by TLS has read ahead no longer
/// shows at the socket, and what it has sealed and not got rid of has to be sent without being asked for.
class SocketLink : public Link {
 public:
  [[nodiscard]] virtual int fd() const = 0;
  /// Whether bytes may have come that do not show at the socket.
  [[nodiscard]] virtual bool has_read_ahead() const { return false; }
  /// Whether bytes that it has taken still wait for the socket.
  [[nodiscard]] virtual bool has_unsent() const { return false; }
  /// Hands them to the socket, as many as it takes.
  virtual void send_unsent() {}
};

}  // namespace birdseye::wire
