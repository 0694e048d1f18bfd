#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cstdint>

#include "drivers/system/unique_fd.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::testing {

inline Deadline soon() {
  return Deadline::after(Duration::from_ms(20'000));
}

/// A connection from an address of this machine's own network, each of which is a machine to the server.
inline UniqueFd connection(const char* from, int port) {
  UniqueFd fd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  ::inet_pton(AF_INET, from, &address.sin_addr);
  EXPECT_EQ(::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  ::inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
  EXPECT_EQ(::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  return fd;
}

/// Whether the server has a place for it: what it sends first comes, or the end.
inline bool is_served(const UniqueFd& fd) {
  std::uint8_t byte = 0;
  return wait_ready(fd.get(), POLLIN, soon()) != 0 && ::recv(fd.get(), &byte, 1, MSG_PEEK) == 1;
}

inline bool is_put_out(const UniqueFd& fd) {
  std::array<std::uint8_t, 4096> bytes{};
  while (wait_ready(fd.get(), POLLIN, soon()) != 0) {
    if (::recv(fd.get(), bytes.data(), bytes.size(), 0) <= 0) return true;
  }
  return false;
}

}  // namespace birdseye::testing
