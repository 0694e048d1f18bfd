// Recordings whose file somebody takes away while they are written.

#include "device/birdseyed/record_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "device/birdseyed/recorder.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::device {
namespace {

RawEvent some_bytes() {
  return TrackerBytes{{{0x80, 1}, DeviceTime{1}}};
}

template <typename Condition>
bool becomes_true(Condition condition) {
  const DeviceTime deadline = device_now() + Duration::from_ms(20'000);
  while (!condition() && device_now() < deadline) sleep_for(Duration::from_ms(2));
  return condition();
}

TEST(RecordFile, OneThatIsRemovedOrExchangedEndsItAndIsSaid) {
  for (const bool exchanged : {false, true}) {
    const birdseye::testing::Scratch scratch;
    RecordConfig config;
    config.folder = scratch / "recordings";
    const auto recorder = *Recorder::start(config, {});
    const auto path = recorder->path();
    if (exchanged) {
      std::filesystem::rename(path, scratch / "moved");
      std::ofstream(path) << "another";
    } else {
      std::filesystem::remove(path);
    }
    EXPECT_TRUE(becomes_true([&] {
      recorder->take(some_bytes());
      return recorder->text() ==
             path.string() + ": ended, somebody has removed or replaced its file; restart birdseyed to begin another";
    })) << recorder->text();
  }
}

TEST(RecordFile, OneThatIsMovedIsWrittenOn) {
  const birdseye::testing::Scratch scratch;
  RecordConfig config;
  config.folder = scratch / "recordings";
  auto recorder = *Recorder::start(config, {});
  const std::string path = recorder->path();
  std::filesystem::rename(path, scratch / "moved.berec");
  recorder->take(some_bytes());
  recorder.reset();
  auto reader = RawEventReader::open(scratch / "moved.berec");
  ASSERT_TRUE(reader);
  const auto event = reader->next();
  ASSERT_TRUE(event && *event);
  EXPECT_FALSE(reader->cut_short());
}

}  // namespace
}  // namespace birdseye::device
