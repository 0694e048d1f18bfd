#include "device/wire/tcp_link.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "device/wire/socket_link.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::wire {

namespace {

constexpr Duration kConnectAgain = Duration::from_ms(50);
constexpr std::size_t kMostParts = 4;

class TcpLink final : public SocketLink {
 public:
  TcpLink(UniqueFd fd, bool is_known) : fd_(std::move(fd)), host_(peer_of(fd_)), is_known_(is_known) {}

  Result<std::size_t> read_some(std::span<std::uint8_t> into) override {
    const ssize_t got = ::recv(fd_.get(), into.data(), into.size(), MSG_DONTWAIT);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return std::size_t{0};
    if (got <= 0) return gone();
    return static_cast<std::size_t>(got);
  }
  Result<std::size_t> write_some(std::span<const std::span<const std::uint8_t>> parts) override {
    std::array<iovec, kMostParts> vectors{};
    const std::size_t count = std::min(parts.size(), vectors.size());
    // sendmsg takes what it sends as something it might change.
    std::transform(parts.begin(), parts.begin() + static_cast<std::ptrdiff_t>(count), vectors.begin(),
                   [](const auto& part) {
                     return iovec{const_cast<std::uint8_t*>(part.data()), part.size()};
                   });
    msghdr message{};
    message.msg_iov = vectors.data();
    message.msg_iovlen = count;
    const ssize_t put = ::sendmsg(fd_.get(), &message, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (put < 0 && (errno == EAGAIN || errno == EINTR)) return std::size_t{0};
    if (put < 0) return gone();
    return static_cast<std::size_t>(put);
  }
  bool wait_readable(Deadline deadline) override { return wait_ready(fd_.get(), POLLIN, deadline) != 0; }
  bool wait_writable(Deadline deadline) override { return wait_ready(fd_.get(), POLLOUT, deadline) != 0; }
  [[nodiscard]] std::string host() const override { return host_; }
  [[nodiscard]] bool is_known() const override { return is_known_; }
  [[nodiscard]] int fd() const override { return fd_.get(); }

 private:
  static Error gone() { return {Errc::disconnected, "the other side has gone"}; }

  UniqueFd fd_;
  std::string host_;
  bool is_known_;
};

/// Empty: not connected, now or by the deadline.
UniqueFd try_connect(const addrinfo& address, Deadline deadline) {
  UniqueFd fd(::socket(address.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd || ::connect(fd.get(), address.ai_addr, address.ai_addrlen) == 0) return fd;
  int failed = 0;
  socklen_t size = sizeof failed;
  if (errno == EINPROGRESS && wait_ready(fd.get(), POLLOUT, deadline) != 0 &&
      ::getsockopt(fd.get(), SOL_SOCKET, SO_ERROR, &failed, &size) == 0 && failed == 0) {
    return fd;
  }
  return {};
}

}  // namespace

std::string peer_of(const UniqueFd& connected) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  std::array<char, INET_ADDRSTRLEN> text{};
  if (::getpeername(connected.get(), reinterpret_cast<sockaddr*>(&address), &size) != 0 ||
      address.sin_family != AF_INET)
    return {};
  return ::inet_ntop(AF_INET, &address.sin_addr, text.data(), text.size()) == nullptr ? "" : text.data();
}

bool is_loopback(const std::string& address) {
  in_addr parsed{};
  return ::inet_pton(AF_INET, address.c_str(), &parsed) == 1 && ntohl(parsed.s_addr) >> 24U == 127;
}

std::string fault_of_bind(const std::string& address) {
  constexpr unsigned kFirstOfGroups = 224;  // from here on multicast, reserved and broadcast
  in_addr read{};
  if (::inet_pton(AF_INET, address.c_str(), &read) != 1)
    return fmt::format("\"{}\": give an IPv4 address of this machine, as 127.0.0.1", address);
  if (ntohl(read.s_addr) >> 24U >= kFirstOfGroups)
    return fmt::format("\"{}\" is no machine's but that of many; give an IPv4 address of this machine", address);
  return {};
}

std::unique_ptr<Link> link_over(UniqueFd connected) {
  const std::string peer = peer_of(connected);
  return link_over(std::move(connected), peer.empty() || is_loopback(peer));
}

std::unique_ptr<Link> link_over(UniqueFd connected, bool is_known) {
  return std::make_unique<TcpLink>(std::move(connected), is_known);
}

Result<std::unique_ptr<Link>> connect_tcp(const std::string& host, int port, Deadline deadline) {
  auto socket = connect_socket(host, port, deadline);
  if (!socket) return socket.error();
  return link_over(*std::move(socket));
}

Result<UniqueFd> connect_socket(const std::string& host, int port, Deadline deadline) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found) != 0) {
    return Error{Errc::not_found, fmt::format("{}:{}: no such host", host, port)};
  }
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owner(found, ::freeaddrinfo);
  for (;;) {
    if (UniqueFd fd = try_connect(*found, deadline)) return fd;
    if (deadline.passed()) {
      return Error{Errc::not_found, fmt::format("{}:{}: nothing answers", host, port)};
    }
    sleep_for(kConnectAgain);
  }
}

}  // namespace birdseye::wire
