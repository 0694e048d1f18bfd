#include "hw-sim/base/listener.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace birdseye::hw_sim {

namespace {

constexpr int kKind = SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK;

template <typename Address>
bool bound(int fd, const Address& address) {
  return fd >= 0 && ::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
         ::listen(fd, 4) == 0;
}

}  // namespace

Result<UniqueFd> listen_at_path(const std::filesystem::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string name = path.string();
  if (name.empty() || name.size() >= sizeof address.sun_path) {
    return Error{Errc::bad_value, fmt::format("{}: too long for a socket; give a shorter path", name)};
  }
  std::memcpy(address.sun_path, name.c_str(), name.size() + 1);
  std::error_code error;
  if (std::filesystem::is_socket(path, error)) ::unlink(name.c_str());
  UniqueFd fd(::socket(AF_UNIX, kKind, 0));
  if (!bound(fd.get(), address)) {
    return Error{Errc::unreadable, fmt::format("{}: cannot be listened at; does its folder exist?", name)};
  }
  return fd;
}

Result<UniqueFd> listen_at_port(const std::string& host, int& port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  if (::inet_pton(AF_INET, host == "localhost" ? "127.0.0.1" : host.c_str(), &address.sin_addr) != 1) {
    return Error{Errc::bad_value, fmt::format("{}: is no IPv4 address of this machine; give one, as 127.0.0.1", host)};
  }
  UniqueFd fd(::socket(AF_INET, kKind, 0));
  const int yes = 1;
  ::setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (!bound(fd.get(), address)) {
    return Error{errno == EADDRINUSE ? Errc::in_use : Errc::unreadable,
                 fmt::format("{}:{}: cannot be listened at: {}; give another port", host, port, std::strerror(errno))};
  }
  socklen_t size = sizeof address;
  ::getsockname(fd.get(), reinterpret_cast<sockaddr*>(&address), &size);
  port = ntohs(address.sin_port);
  return fd;
}

}  // namespace birdseye::hw_sim
