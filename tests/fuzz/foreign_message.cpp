// What an OpenIGTLink server sends that is no appliance, and what is made of it.

#include "device/wire/foreign_feed.hpp"
#include "tests/fuzz/events.hpp"
#include "tests/fuzz/wire_bytes.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  constexpr Duration kEach = Duration::from_ms(10), kSilence = Duration::from_ms(3000);
  HostTime now{1'000'000'000};
  wire::ForeignFeed feed(wire::ForeignSettings{}, now);
  const auto take = [&] {
    while (const auto event = feed.next(now)) testing::must_be_sound(*event);
  };
  for (const auto& message : testing::whole_messages({data, size})) {
    const auto header = wire::read_header(message, wire::kLargestBody);
    if (!header) continue;
    now = now + kEach;
    feed.push(*header, testing::ByteView(message).subspan(wire::kHeaderBytes), now);
    take();
  }
  now = now + kSilence;
  take();
  const std::string words = feed.words();
  testing::must(std::all_of(words.begin(), words.end(), [](char c) { return c >= ' ' && c <= '~'; }),
                "what a server says can be shown");
  return 0;
}
