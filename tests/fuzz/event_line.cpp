// A line of a session recording's events.

#include "host/recording/event_lines.hpp"
#include "tests/fuzz/events.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const auto read = host::parse_event_line(testing::as_text({data, size}));
  if (!read) return 0;
  testing::must_be_sound(read->event);
  const std::string line = host::event_line(read->event, read->place);
  const auto again = host::parse_event_line(line);
  testing::must(again && host::event_line(again->event, again->place) == line, "what is written reads back the same");
  return 0;
}
