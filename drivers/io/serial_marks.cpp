#include "drivers/io/serial_marks.hpp"

namespace birdseye::drivers {

SerialMarks::Step SerialMarks::decode(std::span<const std::uint8_t> raw, std::span<std::uint8_t> into) {
  constexpr std::uint8_t kEscape = 0xFF;
  Step step;
  while (step.used < raw.size() && step.made < into.size()) {
    const std::uint8_t byte = raw[step.used++];
    if (after_ == After::mark) {
      after_ = After::sound;
      step.damaged = true;
      return step;
    }
    if (after_ == After::escape && byte == 0) {
      after_ = After::mark;
    } else if (after_ == After::sound && byte == kEscape) {
      after_ = After::escape;
    } else {  // a sound byte, or the second half of a doubled one
      after_ = After::sound;
      into[step.made++] = byte;
    }
  }
  return step;
}

}  // namespace birdseye::drivers
