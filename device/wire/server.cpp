#include "device/wire/server.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <vector>

namespace birdseye::wire {

namespace {

constexpr std::size_t kMostQueuedBytes = 32U << 20U;  // about a second of PAL video
constexpr std::size_t kMostClients = 16;

}  // namespace

Result<std::unique_ptr<Server>> Server::listen(const std::string& bind_address, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  if (::inet_pton(AF_INET, bind_address.c_str(), &address.sin_addr) != 1) {
    return Error{Errc::bad_value, fmt::format("[wire] bind \"{}\": give an IPv4 address, as 127.0.0.1", bind_address)};
  }
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int on = 1;
  if (fd >= 0) ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  socklen_t size = sizeof address;
  if (fd < 0 || ::bind(fd, reinterpret_cast<const sockaddr*>(&address), size) != 0 || ::listen(fd, 8) != 0 ||
      ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    const int failed = errno;
    if (fd >= 0) ::close(fd);
    if (failed == EADDRINUSE) {
      return Error{
          Errc::in_use,
          fmt::format("[wire] port {} on {} is in use; stop the other program or choose another", port, bind_address),
          failed};
    }
    return Error{Errc::bad_value,
                 fmt::format("[wire] bind {} port {}: this machine cannot listen there", bind_address, port), failed};
  }
  return std::unique_ptr<Server>(new Server(fd, ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), ntohs(address.sin_port)));
}

Server::Server(int fd, int wake_fd, int port) : fd_(fd), wake_fd_(wake_fd), port_(port) {
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Server::~Server() {
  thread_.request_stop();
  const std::uint64_t one = 1;
  (void)!::write(wake_fd_, &one, sizeof one);
  if (thread_.joinable()) thread_.join();
  for (const ClientQueue& client : clients_) ::close(client.fd);
  ::close(fd_);
  ::close(wake_fd_);
}

void Server::publish(const Packet& packet) {
  {
    const std::lock_guard lock(mutex_);
    for (ClientQueue& client : clients_) {
      if (!client.packets.empty() && client.bytes + packet->size() > kMostQueuedBytes) {
        ++shed_;
        continue;
      }
      client.packets.push_back(packet);
      client.bytes += packet->size();
    }
  }
  const std::uint64_t one = 1;
  (void)!::write(wake_fd_, &one, sizeof one);
}

std::size_t Server::clients() const {
  const std::lock_guard lock(mutex_);
  return clients_.size();
}

void Server::accept_one() {
  const int client = ::accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (client < 0) return;
  const std::lock_guard lock(mutex_);
  if (clients_.size() >= kMostClients) {
    ::close(client);
    return;
  }
  const int on = 1;
  ::setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  clients_.push_back({client, {}, 0, 0});
}

bool Server::serve(ClientQueue& client, short events) {
  if ((events & (POLLERR | POLLHUP | POLLNVAL)) != 0) return false;
  if ((events & POLLIN) != 0) {
    // Clients have nothing to ask of us yet; what they say is read so that their close is seen.
    std::array<std::uint8_t, 4096> ignored;
    const ssize_t got = ::recv(client.fd, ignored.data(), ignored.size(), 0);
    if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) return false;
  }
  while (!client.packets.empty()) {
    const std::vector<std::uint8_t>& first = *client.packets.front();
    const ssize_t put =
        ::send(client.fd, first.data() + client.sent_of_first, first.size() - client.sent_of_first, MSG_NOSIGNAL);
    if (put < 0) return errno == EAGAIN || errno == EINTR;
    client.sent_of_first += static_cast<std::size_t>(put);
    if (client.sent_of_first < first.size()) return true;
    client.bytes -= first.size();
    client.sent_of_first = 0;
    client.packets.pop_front();
  }
  return true;
}

void Server::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    std::vector<pollfd> entries{{fd_, POLLIN, 0}, {wake_fd_, POLLIN, 0}};
    {
      const std::lock_guard lock(mutex_);
      for (const ClientQueue& client : clients_) {
        entries.push_back({client.fd, static_cast<short>(client.packets.empty() ? POLLIN : POLLIN | POLLOUT), 0});
      }
    }
    if (::poll(entries.data(), entries.size(), 200) <= 0) continue;
    std::uint64_t count = 0;
    (void)!::read(wake_fd_, &count, sizeof count);
    {
      const std::lock_guard lock(mutex_);
      auto entry = entries.begin() + 2;
      for (auto client = clients_.begin(); client != clients_.end() && entry != entries.end(); ++entry) {
        if (serve(*client, entry->revents)) {
          ++client;
        } else {
          ::close(client->fd);
          client = clients_.erase(client);
        }
      }
    }
    if ((entries[0].revents & POLLIN) != 0) accept_one();
  }
}

}  // namespace birdseye::wire
