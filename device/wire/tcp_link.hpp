#pragma once

#include <functional>
#include <memory>
#include <string>

#include "device/wire/link.hpp"
#include "device/wire/refusal_log.hpp"
#include "device/wire/tls.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye::wire {

/// Over a stream socket that is connected and does not block. is_known: whether the other side is one that Link calls
/// so; without it, whether it is on this machine.
std::unique_ptr<Link> link_over(UniqueFd connected);
std::unique_ptr<Link> link_over(UniqueFd connected, bool is_known);

/// Tries until the deadline: an appliance that is starting is not an error yet.
Result<UniqueFd> connect_socket(const std::string& host, int port, Deadline deadline);
Result<std::unique_ptr<Link>> connect_tcp(const std::string& host, int port, Deadline deadline);

/// The address of the other side; empty: it has none.
std::string peer_of(const UniqueFd& connected);
/// Whether it is an address by which a machine speaks to itself and to no other (127.0.0.0/8).
bool is_loopback(const std::string& address);
/// Why no server can wait for others at an address, in words; empty where one can: an IPv4 address in dots of one
/// machine.
std::string fault_of_bind(const std::string& address);

/// Who is let in, and how. Programs of this machine speak plain; others by TLS, and plain only where that is allowed.
struct Admission {
  std::shared_ptr<const Tls> tls;  ///< null: nobody is let in by TLS
  bool allow_plain = false;
  std::function<bool(const std::string&)> is_local = is_loopback;  ///< by the address
  Duration patience = Duration::from_ms(5000);                     ///< with a handshake
  RefusalLog::Tell tell_refused = {};  ///< is told who was not let in and why, from the thread of Listener::wait()
};

/// port 0 takes any that is free. A port in use is an error that names it and the setting. Handshakes have a bound in
/// time, number and rate, each machine by itself: whoever begins one and does not go on takes nothing from the others.
Result<std::unique_ptr<Listener>> listen_tcp(const std::string& bind_address, int port, Admission admission = {});
/// Whether listen_tcp() could listen on the address: asks the kernel with a port that is free, and leaves it.
Result<void> check_bind(const std::string& bind_address);

}  // namespace birdseye::wire
