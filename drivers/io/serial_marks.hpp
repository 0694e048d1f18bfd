#pragma once

#include <cstdint>
#include <span>

namespace birdseye::drivers {

/// Undoes what a terminal with PARMRK set does to its input: a damaged byte X (parity, framing, break) arrives as
/// FF 00 X, and a sound FF as FF FF. Bytes may come in any portions.
class SerialMarks {
 public:
  struct Step {
    std::size_t used = 0;  ///< of raw
    std::size_t made = 0;  ///< in into
    bool damaged = false;  ///< a damaged byte followed those made, and has been dropped
  };
  /// Goes on until raw is used up, into is full, or a damaged byte has been passed.
  Step decode(std::span<const std::uint8_t> raw, std::span<std::uint8_t> into);

 private:
  enum class After { sound, escape, mark } after_ = After::sound;
};

}  // namespace birdseye::drivers
