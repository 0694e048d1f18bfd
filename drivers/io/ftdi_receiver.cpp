#include "drivers/io/ftdi_receiver.hpp"

#include <algorithm>

#include "drivers/io/ftdi_protocol.hpp"

namespace birdseye::drivers {

void FtdiReceiver::push(std::span<const std::uint8_t> transfer, DeviceTime arrived) {
  while (const auto piece = ftdi::next_piece(transfer, max_packet_)) {
    if (piece->payload.empty()) {
      if (piece->damaged()) ++counters_.empty_errors;
      continue;
    }
    if (piece->damaged()) {
      ++counters_.damaged_packets;
      ++errors_;
      continue;
    }
    if (held_bytes_ + piece->payload.size() > most_bytes_) {
      // What is live matters more than what was: the reader is to find the newest bytes, after one hole.
      packets_.clear();
      held_bytes_ = 0;
      ++counters_.overflows;
      ++errors_;
    }
    ++counters_.packets;
    held_bytes_ += piece->payload.size();
    packets_.push_back({{piece->payload.begin(), piece->payload.end()}, 0, arrived, errors_});
  }
}

void FtdiReceiver::push_failed() {
  ++counters_.failed_transfers;
  ++errors_;
}

void FtdiReceiver::clear() {
  packets_.clear();
  held_bytes_ = 0;
  errors_passed_ = errors_;
}

FtdiReceiver::Taken FtdiReceiver::take(std::span<std::uint8_t> into) {
  if (packets_.empty()) errors_passed_ = errors_;
  if (packets_.empty() || into.empty()) return {};
  UsbPacket& front = packets_.front();
  const std::size_t count = std::min(into.size(), front.bytes.size() - front.taken);
  std::copy_n(front.bytes.begin() + static_cast<std::ptrdiff_t>(front.taken), count, into.begin());
  const Taken taken{count, front.arrived};
  errors_passed_ = front.errors_before;
  front.taken += count;
  held_bytes_ -= count;
  if (front.taken == front.bytes.size()) packets_.pop_front();
  return taken;
}

}  // namespace birdseye::drivers
