// The events of a session recording, in their order. Pictures are those of another target.

#include "host/recording/recording_reader.hpp"
#include "tests/fuzz/events.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::filesystem::path file = testing::as_file("events.jsonl", testing::as_text({data, size}));
  host::RecordingReader::Settings settings;
  settings.pictures = false;
  const auto recording = host::RecordingReader::open(file.parent_path(), settings);
  testing::must(recording.has_value(), "events alone are a recording");
  for (;;) {
    const auto event = (*recording)->next(Deadline::after(Duration::from_ms(10'000)));
    if (!event) break;
    testing::must(event->has_value(), "a recording does not wait");
    testing::must_be_sound(**event);
  }
  return 0;
}
