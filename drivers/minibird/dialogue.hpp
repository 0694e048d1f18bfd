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
  /// quiet: after so much silence no more bytes are expected; more than a measurement cycle.
  Dialogue(ByteStream& line, Duration reply_timeout, Duration quiet)
      : line_(line), reply_timeout_(reply_timeout), quiet_(quiet) {}

  /// still: called every few tens of ms during the conversation, for whoever watches that nothing hangs.
  void obey(std::stop_token stop, std::function<void()> still = {}) {
    stop_ = std::move(stop);
    still_ = std::move(still);
  }
  [[nodiscard]] const std::string& name() const { return line_.name(); }

  /// unit: 0 for the one that has the port, else the address in a flock.
  Result<void> send(const Bytes& command, std::uint8_t unit = 0);
  /// The reply to EXAMINE, asked for a second time where it fails. Errc::timeout: the unit does not answer, or not with
  /// a whole reply.
  Result<Bytes> ask(std::uint8_t parameter, std::uint8_t unit = 0);
  /// The same, asked for once, for a parameter that the unit may not know. Empty where the unit says nothing.
  Result<std::optional<Bytes>> ask_if_known(std::uint8_t parameter, std::uint8_t unit = 0);
  /// Stops a stream and discards what still comes of it. Errc::bad_format: the other side goes on sending, whatever it
  /// is told.
  Result<void> hush();
  /// All bytes that come until nothing has come for `quiet`, or `most` bytes have come, or `within` is over.
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
