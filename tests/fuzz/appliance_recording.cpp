// An appliance recording, and what an appliance says of its events.

#include "device/birdseyed/byte_codec.hpp"
#include "device/birdseyed/recording.hpp"
#include "tests/fuzz/events.hpp"
#include "tests/support/wire_messages.hpp"

namespace {

using namespace birdseye;

/// The input's blocks with sizes and checksums that fit: of a kind its first byte counts, of a size its first two.
std::string whole_blocks(testing::ByteView input) {
  testing::Pieces rest(input);
  (void)rest.take(device::kMagicBytes);
  std::string file = testing::as_text(device::recording_magic());
  while (!rest.empty()) {
    const std::uint32_t kind = rest.byte();
    (void)rest.take(3);
    std::size_t size = rest.byte();
    size |= std::size_t{rest.byte()} << 8U;
    (void)rest.take(6);
    const auto payload = rest.take(size);
    (void)rest.take(sizeof(std::uint64_t));
    device::ByteWriter block, sum;
    block.put(kind);
    block.put_bytes(payload);
    const auto bytes = block.take();
    sum.put(wire::checksum(bytes));
    file += testing::as_text(bytes) + testing::as_text(sum.take());
  }
  return file;
}

void replay(const std::string& file) {
  auto reader = device::RawEventReader::open(testing::as_file("input.berec", file));
  if (!reader) return;
  device::Core core(reader->settings());
  wire::Unpacker unpacker;
  for (;;) {
    const auto event = reader->next();
    if (!event || !*event) return;
    for (const wire::Packet& packet : core.take(**event)) {
      for (const auto& message : testing::messages_of(packet)) {
        const auto told = unpacker.push(message);
        testing::must(told.has_value(), "what is published can be read");
        const auto* const said = *told ? std::get_if<wire::Event>(&**told) : nullptr;
        if (said != nullptr) testing::must_be_sound(*said);
      }
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const testing::ByteView input(data, size);
  replay(testing::as_text(input));
  replay(whole_blocks(input));
  return 0;
}
