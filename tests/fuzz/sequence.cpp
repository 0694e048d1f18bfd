// A PLUS sequence: its header, its pictures, and the events that are made of both.

#include "host/recording/recording_reader.hpp"
#include "host/recording/sequence_reader.hpp"
#include "tests/fuzz/events.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace birdseye;
  const std::string path = testing::as_file("input.igs.mha", testing::as_text({data, size}));
  auto reader = host::SequenceReader::open(path);
  if (!reader) {
    testing::must_name(reader.error().what, path);
    return 0;
  }
  for (const std::size_t index : {reader->frames() - 1, std::size_t{0}, reader->frames()}) {
    const auto rgb = reader->read(index);
    testing::must(rgb.has_value() == (index < reader->frames()), "frames that are whole can be read, and no others");
    const auto pixels = static_cast<std::size_t>(reader->width_px()) * static_cast<std::size_t>(reader->height_px());
    testing::must(!rgb || rgb->size() == 3 * pixels, "a frame has all of its pixels");
  }
  const auto recording = host::RecordingReader::open(path, {});
  if (!recording) return 0;
  while (const auto event = (*recording)->next(Deadline::after(Duration::from_ms(10'000)))) {
    testing::must(event->has_value(), "a recording does not wait");
    testing::must_be_sound(**event);
  }
  return 0;
}
