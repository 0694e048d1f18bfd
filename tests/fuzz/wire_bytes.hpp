#pragma once

#include "tests/fuzz/fuzz.hpp"
#include "tests/support/wire_messages.hpp"

namespace birdseye::testing {

/// The input as messages, one after the other. Of the size of a body the last two bytes count, and what is there; then
/// size and checksum are made to fit, as any sender can make them: a fuzzer does not guess a checksum.
inline std::vector<std::vector<std::uint8_t>> whole_messages(ByteView input) {
  constexpr std::size_t kSizeAt = 48;
  std::vector<std::vector<std::uint8_t>> messages;
  while (input.size() >= wire::kHeaderBytes) {
    const std::size_t told = std::size_t{input[kSizeAt]} << 8U | input[kSizeAt + 1];
    const std::size_t size = wire::kHeaderBytes + std::min(told, input.size() - wire::kHeaderBytes);
    const ByteView message = input.first(size);
    messages.push_back(made_plausible(std::vector<std::uint8_t>(message.begin(), message.end())));
    input = input.subspan(size);
  }
  return messages;
}

}  // namespace birdseye::testing
