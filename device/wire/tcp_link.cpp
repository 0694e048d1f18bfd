#include "device/wire/tcp_link.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>
#include <vector>

#include "drivers/system/wait.hpp"

namespace birdseye::wire {

namespace {

constexpr int kMostCalling = 128;  // whoever finds no room here tries again a second later
constexpr int kMostUnsentBytes = 256 << 10;
constexpr Duration kConnectAgain = Duration::from_ms(50);
constexpr std::size_t kMostParts = 4;

class TcpLink final : public Link {
 public:
  explicit TcpLink(UniqueFd fd) : fd_(std::move(fd)) {}

  [[nodiscard]] int fd() const { return fd_.get(); }

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
  [[nodiscard]] std::string host() const override {
    sockaddr_in address{};
    socklen_t size = sizeof address;
    std::array<char, INET_ADDRSTRLEN> text{};
    if (::getpeername(fd_.get(), reinterpret_cast<sockaddr*>(&address), &size) != 0 || address.sin_family != AF_INET)
      return {};
    return ::inet_ntop(AF_INET, &address.sin_addr, text.data(), text.size()) == nullptr ? "" : text.data();
  }

 private:
  static Error gone() { return {Errc::disconnected, "the other side has gone"}; }

  UniqueFd fd_;
};

class TcpListener final : public Listener {
 public:
  TcpListener(UniqueFd fd, UniqueFd wake_fd, int port)
      : fd_(std::move(fd)), wake_fd_(std::move(wake_fd)), port_(port) {}

  bool wait(std::span<LinkWatch> links, bool to_accept, Deadline deadline) override {
    entries_.assign({{fd_.get(), static_cast<short>(to_accept ? POLLIN : 0), 0}, {wake_fd_.get(), POLLIN, 0}});
    for (const LinkWatch& watch : links) {
      const auto events = static_cast<short>((watch.to_read ? POLLIN : 0) | (watch.to_write ? POLLOUT : 0));
      entries_.push_back({static_cast<const TcpLink*>(watch.link)->fd(), events, 0});
    }
    wait_ready(entries_, deadline);
    if ((entries_[1].revents & POLLIN) != 0) {
      std::uint64_t count = 0;
      (void)!::read(wake_fd_.get(), &count, sizeof count);
    }
    for (std::size_t i = 0; i < links.size(); ++i) {
      const short told = entries_[i + 2].revents;
      links[i].readable = links[i].to_read && (told & (POLLIN | POLLHUP)) != 0;
      const int gone = links[i].to_read ? 0 : POLLHUP;  // else read_some() tells, after the last that came
      links[i].broken = (told & (POLLERR | POLLNVAL | gone)) != 0;
    }
    return (entries_[0].revents & POLLIN) != 0;
  }

  std::unique_ptr<Link> accept() override {
    UniqueFd fd(::accept4(fd_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!fd) return nullptr;
    const int on = 1;
    ::setsockopt(fd.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    // What the kernel holds unsent is no longer ours to shed, and a pose waits behind it.
    ::setsockopt(fd.get(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kMostUnsentBytes, sizeof kMostUnsentBytes);
    return link_over(std::move(fd));
  }

  void wake() override {
    const std::uint64_t one = 1;
    (void)!::write(wake_fd_.get(), &one, sizeof one);
  }

  [[nodiscard]] int port() const override { return port_; }

 private:
  UniqueFd fd_, wake_fd_;
  int port_;
  std::vector<pollfd> entries_;
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

std::unique_ptr<Link> link_over(UniqueFd connected) {
  return std::make_unique<TcpLink>(std::move(connected));
}

Result<std::unique_ptr<Link>> connect_tcp(const std::string& host, int port, Deadline deadline) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found) != 0) {
    return Error{Errc::not_found, fmt::format("{}:{}: no such host", host, port)};
  }
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owner(found, ::freeaddrinfo);
  for (;;) {
    if (UniqueFd fd = try_connect(*found, deadline)) return link_over(std::move(fd));
    if (deadline.passed()) {
      return Error{Errc::not_found, fmt::format("{}:{}: nothing answers", host, port)};
    }
    sleep_for(kConnectAgain);
  }
}

Result<std::unique_ptr<Listener>> listen_tcp(const std::string& bind_address, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  if (::inet_pton(AF_INET, bind_address.c_str(), &address.sin_addr) != 1) {
    return Error{Errc::bad_value, fmt::format("[wire] bind \"{}\": give an IPv4 address, as 127.0.0.1", bind_address)};
  }
  UniqueFd fd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int on = 1;
  if (fd) ::setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  socklen_t size = sizeof address;
  if (!fd || ::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), size) != 0 ||
      ::listen(fd.get(), kMostCalling) != 0 ||
      ::getsockname(fd.get(), reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    if (errno == EADDRINUSE) {
      return Error{Errc::in_use, fmt::format("[wire] port {} on {} is in use; stop the other program or choose another",
                                             port, bind_address)};
    }
    return Error{Errc::bad_value,
                 fmt::format("[wire] bind {} port {}: this machine cannot listen there", bind_address, port)};
  }
  UniqueFd wake_fd(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  return std::unique_ptr<Listener>(
      std::make_unique<TcpListener>(std::move(fd), std::move(wake_fd), ntohs(address.sin_port)));
}

}  // namespace birdseye::wire
