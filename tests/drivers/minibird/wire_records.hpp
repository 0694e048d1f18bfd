#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "drivers/minibird/stream_layout.hpp"

namespace birdseye::testing {

using drivers::minibird::Bytes;
using drivers::minibird::Chunk;

/// Words -> the bytes of one record.
inline Bytes wire_record(const std::vector<int>& words) {
  Bytes bytes;
  for (const int word : words) {
    const auto w = static_cast<std::uint16_t>(word);
    bytes.push_back(static_cast<std::uint8_t>(w >> 2U & 0x7FU));
    bytes.push_back(static_cast<std::uint8_t>(w >> 9U & 0x7FU));
  }
  bytes[0] |= 0x80U;
  return bytes;
}

/// A position_matrix record at 36 in.
inline Bytes wire_record(const Eigen::Vector3d& position_mm,
                         const Eigen::Matrix3d& rotation = Eigen::Matrix3d::Identity()) {
  std::vector<int> words;
  const auto put = [&words](double counts) {
    words.push_back(static_cast<int>(std::clamp(std::lround(counts), -32768L, 32767L)));
  };
  for (int i = 0; i < 3; ++i) put(position_mm[i] / drivers::minibird::kMmPerCount36Inch);
  for (int i = 0; i < 9; ++i) put(rotation(i / 3, i % 3) * 32768);
  return wire_record(words);
}

/// What a line carries: bytes, each with the time at which it was whole at the receiver.
struct Wire {
  struct Byte {
    std::uint8_t byte;
    std::int64_t at_ns;
  };
  double rate_hz = 144;
  std::int64_t byte_ns = 86'805;  ///< at 115200 baud
  std::vector<Byte> bytes;

  [[nodiscard]] std::int64_t start_of(int cycle) const { return std::llround(cycle * 1e9 / rate_hz); }
  /// The bytes of a cycle, back to back from its start; 0 for the first.
  void send(int cycle, const Bytes& of_cycle) {
    std::int64_t at = start_of(cycle);
    for (const std::uint8_t byte : of_cycle) bytes.push_back({byte, at += byte_ns});
  }
  /// Cut into chunks of the lengths that length() gives, each late by what late_ns() gives, none before another.
  template <typename Length, typename Late>
  [[nodiscard]] std::vector<Chunk> cut(Length length, Late late_ns) const {
    std::vector<Chunk> chunks;
    std::int64_t last = 0;
    for (std::size_t at = 0; at < bytes.size();) {
      const std::size_t n = std::min(bytes.size() - at, static_cast<std::size_t>(length()));
      Chunk chunk;
      for (std::size_t i = 0; i < n; ++i) chunk.bytes.push_back(bytes[at + i].byte);
      at += n;
      last = std::max(last, bytes[at - 1].at_ns + static_cast<std::int64_t>(late_ns()));
      chunk.arrived = {last};
      chunks.push_back(chunk);
    }
    return chunks;
  }
};

}  // namespace birdseye::testing
