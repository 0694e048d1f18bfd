#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "calibration/base/result.hpp"
#include "drivers/system/clock.hpp"

namespace birdseye::wire {

/// One end of a connection that carries bytes both ways, in order. Only wait_...() waits.
class Link {
 public:
  virtual ~Link() = default;
  /// How many bytes it has put into `into`; 0: none have come yet. Errc::disconnected: the other side has gone.
  virtual Result<std::size_t> read_some(std::span<std::uint8_t> into) = 0;
  /// How many bytes it has taken of the parts, which follow one another; 0: none for now. Errc::disconnected.
  virtual Result<std::size_t> write_some(std::span<const std::span<const std::uint8_t>> parts) = 0;
  /// Until read_some() would not give 0. False: not by the deadline.
  virtual bool wait_readable(Deadline deadline) = 0;
  /// Until write_some() would not give 0. False: not by the deadline.
  virtual bool wait_writable(Deadline deadline) = 0;
  /// The machine at the other end, by its address or key; empty: this one, without an address.
  [[nodiscard]] virtual std::string host() const = 0;
  /// Whether the other end is on this machine or on one whose key is known here.
  [[nodiscard]] virtual bool is_known() const { return host().empty(); }
  /// By what name the machine at the other end is known here, by the key that it has shown; empty: it has shown none.
  [[nodiscard]] virtual std::string peer_name() const { return {}; }
};

/// A link that a listener watches, and what became of it.
struct LinkWatch {
  Link* link = nullptr;   ///< which this listener has accepted
  bool to_read = true;    ///< what comes is read
  bool to_write = false;  ///< there is something to write to it
  bool readable = false;  ///< told by wait(): bytes have come, or the other side has gone
  bool broken = false;    ///< told by wait(): nothing can be read or written any more
};

/// Where links come from, and the one wait of whoever serves them all. Used by one thread, but for wake().
class Listener {
 public:
  virtual ~Listener() = default;
  /// Waits until something can be read from or written to one of the links, somebody wants to be accepted (where
  /// to_accept), or wake() is called; no longer than until the deadline. Whether somebody wants to be accepted.
  virtual bool wait(std::span<LinkWatch> links, bool to_accept, Deadline deadline) = 0;
  /// Null: whoever wanted to be has gone.
  virtual std::unique_ptr<Link> accept() = 0;
  /// Ends the wait(), or the next one. From any thread.
  virtual void wake() = 0;
  [[nodiscard]] virtual int port() const = 0;
};

}  // namespace birdseye::wire
