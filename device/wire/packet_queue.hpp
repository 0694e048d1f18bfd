#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <optional>
#include <utility>

#include "device/wire/packet.hpp"

namespace birdseye::wire {

/// Packets that wait and of which nothing has been sent. Bounded, and what is live wins: where there are too many of a
/// kind, the oldest of that kind goes. Of STATUS, Calibration and the volume only the newest waits, and it never goes.
class PacketQueue {
 public:
  static constexpr std::size_t kMostFrames = 3;
  static constexpr std::size_t kMostOfAKind = 256;                 ///< of small ones: of poses more than two seconds
  static constexpr std::size_t kMostSmall = 2 * kMostOfAKind + 2;  ///< poses, others; a STATUS and a Calibration

  /// Queues a packet and returns how many were shed for it. A STATUS, Calibration or volume replaces the one that
  /// waits, which is then out of date and not counted as shed.
  std::size_t push(const Packet& packet) {
    if (packet.kind == Packet::Kind::frame) {
      frames_.push_back(packet);
      return frames_.size() > kMostFrames ? shed_frame() : 0;
    }
    if (packet.kind == Packet::Kind::volume) {
      volume_ = packet;
      return 0;
    }
    const auto same = [&](const Packet& other) { return other.kind == packet.kind; };
    if (packet.kind == Packet::Kind::status || packet.kind == Packet::Kind::calibration) {
      const auto waiting = std::ranges::find_if(small_, same);
      if (waiting != small_.end()) {
        *waiting = packet;
        return 0;
      }
    }
    small_.push_back(packet);
    if (small_.size() <= kMostOfAKind || std::ranges::count_if(small_, same) <= std::ptrdiff_t{kMostOfAKind}) return 0;
    small_.erase(std::ranges::find_if(small_, same));
    return 1;
  }
  /// Sheds the oldest frame; returns how many were shed, 0 or 1.
  std::size_t shed_frame() {
    if (frames_.empty()) return 0;
    frames_.pop_front();
    return 1;
  }
  void forget_frames() { frames_.clear(); }

  [[nodiscard]] bool empty() const { return small_.empty() && frames_.empty() && !volume_; }
  /// The packet to send next: small packets before frames, frames before the volume, otherwise in the order in which
  /// they came.
  [[nodiscard]] const Packet& front() const { return small_.empty() && frames_.empty() ? *volume_ : next().front(); }
  Packet pop() {
    if (small_.empty() && frames_.empty()) return *std::exchange(volume_, std::nullopt);
    std::deque<Packet>& from = small_.empty() ? frames_ : small_;
    Packet packet = std::move(from.front());
    from.pop_front();
    return packet;
  }
  [[nodiscard]] const std::deque<Packet>& frames() const { return frames_; }
  [[nodiscard]] const std::deque<Packet>& small() const { return small_; }

 private:
  [[nodiscard]] const std::deque<Packet>& next() const { return small_.empty() ? frames_ : small_; }

  std::deque<Packet> small_, frames_;
  std::optional<Packet> volume_;
};

}  // namespace birdseye::wire
