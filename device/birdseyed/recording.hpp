#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/record/file_signature.hpp"
#include "calibration/record/sha256.hpp"
#include "device/birdseyed/core.hpp"

/// An appliance recording, a file of raw events (docs/manual/appliance-recording.md): eight bytes of magic, then blocks
/// of kind, size, payload, checksum. A block is whole or it is not: a file that was cut anywhere, as by a power cut, is
/// good up to the last whole block.
namespace birdseye::device {

using Bytes = std::vector<std::uint8_t>;

inline constexpr std::size_t kMagicBytes = 8;
Bytes recording_magic();
/// The core's settings: the first block of a file.
Bytes block_of(const CoreSettings& settings);
Bytes block_of(const RawEvent& event);
/// Over the SHA-256 of all bytes before it: the last block, where the recording was ended in order.
Bytes block_of(const calibration::FileSignature& signature);

/// Reads a file front to back.
class RawEventReader {
 public:
  /// Refuses what is no appliance recording, and one of another version.
  static Result<RawEventReader> open(const std::filesystem::path& path);

  [[nodiscard]] const CoreSettings& settings() const { return settings_; }
  /// The next event; empty at the end. An error where a block is damaged: what follows cannot be trusted.
  Result<std::optional<RawEvent>> next();
  /// Whether the file ended inside a block.
  [[nodiscard]] bool cut_short() const { return cut_short_; }
  /// The SHA-256 of all that was read, as ApplianceSeal has it: once next() has given the end. Nothing can be read
  /// afterwards.
  [[nodiscard]] std::string sha256() { return sum_.hex(); }

 private:
  struct Block {
    std::uint32_t kind = 0;
    Bytes payload;
  };
  RawEventReader(std::ifstream in, std::string name) : in_(std::move(in)), name_(std::move(name)) {}
  Result<std::optional<Block>> next_block();

  std::ifstream in_;
  std::string name_;
  CoreSettings settings_;
  calibration::Sha256 sum_;
  bool cut_short_ = false;
};

}  // namespace birdseye::device
