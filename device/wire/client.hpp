#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "device/wire/unpacker.hpp"

namespace birdseye::wire {

/// A host's end of the wire.
class Client {
 public:
  using Clock = std::chrono::steady_clock;

  /// Tries until the deadline: an appliance that is starting is not an error yet.
  static Result<std::unique_ptr<Client>> connect(const std::string& host, int port, Clock::time_point deadline);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// The next event; empty at the deadline; Errc::disconnected when the appliance has gone.
  Result<std::optional<Event>> next(Clock::time_point deadline);
  /// Says what this client wants; without it, it gets everything.
  Result<void> subscribe(const Subscription& subscription, Clock::time_point deadline);

 private:
  Client(int fd, std::string name) : fd_(fd), name_(std::move(name)) {}
  Result<void> send(const Packet& packet, Clock::time_point deadline);
  Result<bool> fill(std::size_t size, Clock::time_point deadline);

  int fd_;
  std::string name_;
  std::vector<std::uint8_t> buffer_;
  std::size_t have_ = 0;
  Unpacker unpacker_;
};

}  // namespace birdseye::wire
