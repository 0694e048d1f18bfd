// What an appliance sends, as a host reads it.

#include "device/wire/unpacker.hpp"
#include "tests/fuzz/events.hpp"
#include "tests/fuzz/wire_bytes.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const testing::ByteView input(data, size);
  wire::Unpacker unpacker;
  (void)unpacker.push(input);
  for (const auto& message : testing::whole_messages(input)) {
    const auto told = unpacker.push(message);
    if (!told || !*told) continue;
    if (const auto* event = std::get_if<wire::Event>(&**told)) testing::must_be_sound(*event);
  }
  return 0;
}
