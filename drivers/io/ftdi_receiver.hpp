#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "calibration/time/clock.hpp"

namespace birdseye::drivers {

struct FtdiCounters {
  std::uint64_t packets = 0;          ///< with payload
  std::uint64_t damaged_packets = 0;  ///< dropped: the chip flagged an error in them
  std::uint64_t empty_errors = 0;     ///< error flags in empty packets, which a chip may repeat without end
  std::uint64_t failed_transfers = 0;
  std::uint64_t overflows = 0;  ///< how often nobody read for so long that what had come was thrown away
};

/// Between an FTDI chip's packets and a reader of bytes: strips the status bytes, drops what is damaged, and keeps a
/// bounded store of the rest, each packet with its time of arrival. No I/O, no clock.
class FtdiReceiver {
 public:
  FtdiReceiver(std::size_t max_packet, std::size_t most_bytes) : max_packet_(max_packet), most_bytes_(most_bytes) {}

  /// A finished transfer: one packet or several back to back.
  void push(std::span<const std::uint8_t> transfer, DeviceTime arrived);
  /// A transfer that the bus lost: there may have been bytes in it.
  void push_failed();
  /// Drops the bytes that wait; the reader asks for it.
  void clear();

  struct Taken {
    std::size_t bytes = 0;
    DeviceTime arrived;
  };
  /// At most one packet's bytes, so that all of them came at the same time.
  Taken take(std::span<std::uint8_t> into);

  [[nodiscard]] bool empty() const { return packets_.empty(); }
  /// How many errors lie before the bytes last taken; all errors, when there was nothing to take. The count changes in
  /// take() alone, so that a reader sees it change with the first bytes behind the hole, never with those before.
  [[nodiscard]] std::uint64_t errors_passed() const { return errors_passed_; }
  [[nodiscard]] const FtdiCounters& counters() const { return counters_; }

 private:
  struct UsbPacket {
    std::vector<std::uint8_t> bytes;
    std::size_t taken = 0;
    DeviceTime arrived;
    std::uint64_t errors_before = 0;
  };

  std::size_t max_packet_, most_bytes_;
  std::deque<UsbPacket> packets_;
  std::size_t held_bytes_ = 0;
  std::uint64_t errors_ = 0, errors_passed_ = 0;
  FtdiCounters counters_;
};

}  // namespace birdseye::drivers
