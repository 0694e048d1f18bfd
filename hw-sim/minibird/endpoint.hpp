#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::hw_sim {

/// The instrument's end of a line to a host. A host may go and another come; one at a time.
class Endpoint {
 public:
  virtual ~Endpoint() = default;

  /// What the host has sent by now, without waiting. Accepts a host that wants to connect.
  virtual std::vector<std::uint8_t> read() = 0;
  /// Sends bytes. What the line cannot take at once, or nobody is there to take, is lost, as on a real line.
  virtual void write(std::span<const std::uint8_t> bytes) = 0;
  /// Whether somebody is at the other end. A pseudo-terminal cannot tell and says yes.
  [[nodiscard]] virtual bool connected() const = 0;
  /// Returns when the host has sent something or wants to connect, at the latest at this time of CLOCK_MONOTONIC.
  virtual void wait(std::int64_t until_ns) = 0;
  /// The cable is pulled: hosts are hung up on and none can come before replug().
  virtual void unplug() = 0;
  virtual Result<void> replug() = 0;
  /// The name that a host opens: a path, or HOST:PORT with the port that was taken.
  [[nodiscard]] virtual const std::string& name() const = 0;
};

/// A pseudo-terminal under the name of a symbolic link.
Result<std::unique_ptr<Endpoint>> open_terminal(const std::filesystem::path& link);
/// Listens at [HOST:]PORT, on the loopback interface where no host is given; port 0 takes a free one.
Result<std::unique_ptr<Endpoint>> listen_tcp(const std::string& address);
/// Listens at a Unix stream socket, which goes away with the endpoint.
Result<std::unique_ptr<Endpoint>> listen_unix(const std::filesystem::path& path);

}  // namespace birdseye::hw_sim
