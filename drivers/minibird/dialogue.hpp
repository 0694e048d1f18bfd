#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>

#include "drivers/io/byte_stream.hpp"
#include "drivers/minibird/protocol.hpp"

namespace birdseye::drivers::minibird {

/// Commands and replies over a line on which nothing is acknowledged and a reply is known by its length alone. Every
/// wait has an end, and a stop ends it early (Errc::timeout).
class Dialogue {
 public:
  /// quiet: silence after which nothing more is taken to come; more than a measurement cycle.
  Dialogue(ByteStream& line, Duration reply_timeout, Duration quiet)
      : line_(line), reply_timeout_(reply_timeout), quiet_(quiet) {}

  /// still: called every few ten ms while it talks, for whoever watches that nothing hangs.
  void obey(std::stop_token stop, std::function<void()> still = {}) {
    stop_ = std::move(stop);
    still_ = std::move(still);
  }
  [[nodiscard]] const std::string& name() const { return line_.name(); }

  /// unit: 0 for the one that has the port, else the address in a flock.
  Result<void> send(const Bytes& command, std::uint8_t unit = 0);
  /// The reply to EXAMINE, asked for twice. Errc::timeout: it does not answer, or not wholly.
  Result<Bytes> ask(std::uint8_t parameter, std::uint8_t unit = 0);
  /// The same, asked for once, of a parameter that the unit may not know: then it says nothing.
  Result<std::optional<Bytes>> ask_if_known(std::uint8_t parameter, std::uint8_t unit = 0);
  /// Stops a stream, and takes what still comes of it. Errc::bad_format: it sends on whatever it is told.
  Result<void> hush();
  /// All that comes until nothing has for as long as `quiet`, or `most` bytes have, or the time is up.
  Result<Bytes> listen(std::size_t most, Duration quiet, Duration within);
  Result<void> pause(Duration span);

 private:
  Result<std::optional<Bytes>> exchange(std::uint8_t parameter, std::uint8_t unit);
  [[nodiscard]] Error stopped() const;

  ByteStream& line_;
  Duration reply_timeout_, quiet_;
  std::stop_token stop_;
  std::function<void()> still_;
};

/// Bytes for a person: as text where they are text, else in hexadecimal.
std::string shown(const Bytes& bytes);

}  // namespace birdseye::drivers::minibird
