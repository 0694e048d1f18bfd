#include "drivers/io/socket_line.hpp"

#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "drivers/system/thread.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::drivers {

namespace {

struct AddressesEnd {
  void operator()(addrinfo* addresses) const { ::freeaddrinfo(addresses); }
};
using Addresses = std::unique_ptr<addrinfo, AddressesEnd>;

Addresses look_up(const std::string& host, std::uint16_t port, int flags) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = flags | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int failed = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found);
  return Addresses(failed == 0 ? found : nullptr);
}

/// Looking a name up has no deadline of its own and cannot be cut short. Addresses need no looking up and no thread.
Addresses resolve(const std::string& host, std::uint16_t port, Deadline deadline) {
  if (Addresses numeric = look_up(host, port, AI_NUMERICHOST)) return numeric;
  return given_by<Addresses>(deadline, [host, port] { return look_up(host, port, 0); }).value_or(nullptr);
}

/// 0, or why not.
int connect_by(int fd, const sockaddr* address, socklen_t bytes, Deadline deadline) {
  if (::connect(fd, address, bytes) == 0) return 0;
  if (errno == EAGAIN) return ETIMEDOUT;  // a Unix socket whose queue is full
  if (errno != EINPROGRESS) return errno;
  if (wait_ready(fd, POLLOUT, deadline) == 0) return ETIMEDOUT;
  int failed = 0;
  socklen_t size = sizeof failed;
  ::getsockopt(fd, SOL_SOCKET, SO_ERROR, &failed, &size);
  return failed;
}

Error connect_error(const std::string& name, int failed) {
  switch (failed) {
    case ECONNREFUSED:
    case ENOENT:
      return {Errc::not_found, fmt::format("{}: nothing listens there; is it on, and is that its port?", name)};
    case ETIMEDOUT:
    case EHOSTUNREACH:
    case ENETUNREACH:
      return {Errc::timeout, fmt::format("{}: does not answer; check its power, the network and the address", name)};
    case EACCES:
    case EPERM:
      return {Errc::unreadable, fmt::format("{}: no permission to connect; see the socket's owner and mode", name)};
    default:
      return {Errc::io, fmt::format("{}: cannot be connected to: {}", name, std::strerror(failed))};
  }
}

void set_option(int fd, int level, int option, int value) {
  ::setsockopt(fd, level, option, &value, sizeof value);
}

int option_of(int fd, int level, int option) {
  int value = 0;
  socklen_t size = sizeof value;
  return ::getsockopt(fd, level, option, &value, &size) == 0 ? value : 0;
}

/// Two silent seconds, then three questions a second apart: together no more than kDeadPeer. Commands in flight that
/// nobody acknowledges end it as soon.
void watch_peer(int fd) {
  set_option(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
  set_option(fd, IPPROTO_TCP, TCP_KEEPIDLE, 2);
  set_option(fd, IPPROTO_TCP, TCP_KEEPINTVL, 1);
  set_option(fd, IPPROTO_TCP, TCP_KEEPCNT, 3);
  set_option(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, static_cast<int>(SocketLine::kDeadPeer.ns / 1'000'000));
}

}  // namespace

Result<std::unique_ptr<SocketLine>> SocketLine::connect_tcp(const std::string& host, std::uint16_t port,
                                                            Deadline deadline) {
  const std::string name =
      fmt::format("tcp:{}:{}", host.find(':') == std::string::npos ? host : "[" + host + "]", port);
  const Addresses addresses = resolve(host, port, deadline);
  if (!addresses) {
    return Error{Errc::not_found, fmt::format("{}: the host's name is not known; give its address", name)};
  }
  int failed = ETIMEDOUT;
  for (const addrinfo* at = addresses.get(); at != nullptr; at = at->ai_next) {
    UniqueFd fd(::socket(at->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    failed = fd ? connect_by(fd.get(), at->ai_addr, at->ai_addrlen, deadline) : errno;
    if (failed != 0) continue;
    set_option(fd.get(), IPPROTO_TCP, TCP_NODELAY, 1);
    watch_peer(fd.get());
    return std::unique_ptr<SocketLine>(new SocketLine(std::move(fd), name));
  }
  return connect_error(name, failed);
}

Result<std::unique_ptr<SocketLine>> SocketLine::connect_unix(const std::filesystem::path& path, Deadline deadline) {
  const std::string name = "unix:" + path.string();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.string().size() >= sizeof address.sun_path) {
    return Error{Errc::bad_value,
                 fmt::format("{}: too long for a socket, which takes {} bytes", name, sizeof address.sun_path - 1)};
  }
  std::memcpy(address.sun_path, path.c_str(), path.string().size() + 1);
  UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int failed =
      fd ? connect_by(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address, deadline) : errno;
  if (failed != 0) return connect_error(name, failed);
  return std::unique_ptr<SocketLine>(new SocketLine(std::move(fd), name));
}

Error SocketLine::gone(int failed) const {
  return {Errc::disconnected,
          failed == ETIMEDOUT
              ? fmt::format("{}: the other side has fallen silent; check the network and its power", name_)
              : fmt::format("{}: the other side has closed the line", name_)};
}

Result<std::size_t> SocketLine::read(std::span<std::uint8_t> into, Deadline deadline) {
  if (into.empty()) return std::size_t{0};
  for (;;) {
    const ssize_t got = ::recv(fd_.get(), into.data(), into.size(), 0);
    if (got > 0) return static_cast<std::size_t>(got);
    if (got == 0) return gone(0);
    if (errno != EAGAIN && errno != EINTR) return gone(errno);
    if (wait_ready(fd_.get(), POLLIN, deadline) == 0) return std::size_t{0};
  }
}

Result<void> SocketLine::write(std::span<const std::uint8_t> bytes, Deadline deadline) {
  while (!bytes.empty()) {
    const ssize_t put = ::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (put > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(put));
      continue;
    }
    if (put < 0 && errno != EAGAIN && errno != EINTR) return gone(errno);
    if (wait_ready(fd_.get(), POLLOUT, deadline) == 0) {
      return Error{Errc::timeout, fmt::format("{}: does not take commands", name_)};
    }
  }
  return {};
}

void SocketLine::discard_input() {
  // What is here now. A peer that sends as fast as we read is not to keep us for ever.
  std::array<std::uint8_t, 4096> chunk;
  for (int i = 0; i < 64 && ::recv(fd_.get(), chunk.data(), chunk.size(), 0) > 0; ++i) {
  }
}

std::string SocketLine::describe() const {
  if (option_of(fd_.get(), SOL_SOCKET, SO_KEEPALIVE) == 0) return name_ + ": connected";
  const int seconds = option_of(fd_.get(), IPPROTO_TCP, TCP_KEEPIDLE) +
                      option_of(fd_.get(), IPPROTO_TCP, TCP_KEEPINTVL) * option_of(fd_.get(), IPPROTO_TCP, TCP_KEEPCNT);
  return fmt::format("{}: connected, {}, a dead peer is seen within {} s", name_,
                     option_of(fd_.get(), IPPROTO_TCP, TCP_NODELAY) != 0 ? "no delay" : "bytes collected", seconds);
}

}  // namespace birdseye::drivers
