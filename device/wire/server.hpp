#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "device/wire/messages.hpp"

namespace birdseye::wire {

/// Sends packets to every client that is connected. A client that does not keep up loses packets (never parts of one),
/// not the others: each has a bounded queue of its own.
class Server {
 public:
  /// port 0 takes any that is free. A port in use is an error that names it and the setting.
  static Result<std::unique_ptr<Server>> listen(const std::string& bind_address, int port);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  void publish(const Packet& packet);
  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] std::uint64_t messages_shed() const { return shed_; }
  [[nodiscard]] std::size_t clients() const;

 private:
  struct ClientQueue {
    int fd;
    std::deque<Packet> packets;
    std::size_t sent_of_first = 0;
    std::size_t bytes = 0;
  };
  Server(int fd, int wake_fd, int port);
  void run(const std::stop_token& stop);
  void accept_one();
  static bool serve(ClientQueue& client, short events);

  int fd_, wake_fd_, port_;
  mutable std::mutex mutex_;
  std::list<ClientQueue> clients_;
  std::atomic<std::uint64_t> shed_ = 0;
  std::jthread thread_;
};

}  // namespace birdseye::wire
