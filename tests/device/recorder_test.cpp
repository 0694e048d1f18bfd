#include "device/birdseyed/recorder.hpp"

#include <gtest/gtest.h>

#include "device/birdseyed/instrument_board.hpp"
#include "drivers/io/monotonic.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::device {
namespace {

RawEvent bytes(std::uint8_t value) {
  return TrackerBytes{{{0x80, value}, DeviceTime{value}}};
}

TEST(Recorder, KeepsEverythingItIsGiven) {
  const birdseye::testing::Scratch scratch;
  RecordConfig config;
  config.folder = scratch / "recordings";
  std::filesystem::path path;
  {
    auto recorder = Recorder::start(config, {});
    ASSERT_TRUE(recorder) << recorder.error().what;
    path = (*recorder)->path();
    EXPECT_EQ((*recorder)->text(), path.string());
    for (int i = 0; i < 100; ++i) (*recorder)->take(bytes(static_cast<std::uint8_t>(i)));
  }
  auto reader = RecordingReader::open(path);
  ASSERT_TRUE(reader) << reader.error().what;
  for (int i = 0; i < 100; ++i) {
    const auto event = reader->next();
    ASSERT_TRUE(event && *event);
    EXPECT_EQ(std::get<TrackerBytes>(**event).chunk.bytes.back(), i);
  }
  EXPECT_FALSE(*reader->next());
}

TEST(Recorder, EndsAtItsLimitAndSaysSo) {
  const birdseye::testing::Scratch scratch;
  RecordConfig config;
  config.folder = scratch / "recordings";
  config.most_gb = 1e-6;
  const auto recorder = *Recorder::start(config, {});
  for (int i = 0; i < 200; ++i) recorder->take(bytes(1));
  const DeviceTime deadline = drivers::now() + Duration::from_ms(5000);
  while (recorder->text().find("most_gb") == std::string::npos && drivers::now() < deadline) {
    recorder->take(bytes(1));
    drivers::sleep_for(Duration::from_ms(5));
  }
  EXPECT_NE(recorder->text().find("most_gb"), std::string::npos) << recorder->text();
}

TEST(Recorder, AFolderThatCannotBeIsNamed) {
  RecordConfig config;
  config.folder = "/proc/no-such-place";
  const auto recorder = Recorder::start(config, {});
  ASSERT_FALSE(recorder);
  EXPECT_NE(recorder.error().what.find("[record] folder"), std::string::npos);
}

TEST(InstrumentBoard, TellsTheWholeFromItsParts) {
  InstrumentBoard board;
  const auto note = [&board](Instrument instrument, InstrumentState state, const char* text) {
    board.note({.instrument = instrument, .state = state, .text = text});
    return board.state();
  };
  EXPECT_EQ(note(Instrument::tracker, InstrumentState::starting, "t"), ApplianceState::starting);
  EXPECT_EQ(note(Instrument::camera, InstrumentState::running, "c"), ApplianceState::starting);
  EXPECT_EQ(note(Instrument::tracker, InstrumentState::running, "t"), ApplianceState::ready);
  EXPECT_EQ(board.faults(), "");
  EXPECT_EQ(note(Instrument::camera, InstrumentState::silent, "no frames"), ApplianceState::degraded);
  EXPECT_EQ(note(Instrument::tracker, InstrumentState::absent, "no line"), ApplianceState::degraded);
  EXPECT_EQ(board.faults(), "no line; no frames");
  EXPECT_EQ(board.of(Instrument::camera).times_lost, 1U);
  EXPECT_EQ(note(Instrument::camera, InstrumentState::running, "c"), ApplianceState::degraded);
  EXPECT_EQ(note(Instrument::tracker, InstrumentState::running, "t"), ApplianceState::ready);
}

TEST(StatusLed, ShowsEachStateInItsOwnWay) {
  const auto changes = [](ApplianceState state) {
    int count = 0;
    for (int ms = 1; ms < 2000; ++ms)
      count +=
          led_on(state, {std::int64_t{ms} * 1'000'000}) != led_on(state, {std::int64_t{ms - 1} * 1'000'000}) ? 1 : 0;
    return count;
  };
  EXPECT_EQ(changes(ApplianceState::ready), 0);
  EXPECT_TRUE(led_on(ApplianceState::ready, {0}));
  EXPECT_EQ(changes(ApplianceState::starting), 3);
  EXPECT_EQ(changes(ApplianceState::degraded), 19);
}

}  // namespace
}  // namespace birdseye::device
