// Whose recordings are played in place of instruments.
#include "device/birdseyed/replay.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <string>

#include "device/birdseyed/recorder.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::device {
namespace {

using testing::contents_of;
using testing::Scratch;

/// The machine that this program is from now on.
void be(const std::filesystem::path& identity) {
  ::setenv("BIRDSEYE_IDENTITY", identity.c_str(), 1);
}

std::string refusal(const std::filesystem::path& recording, bool accept_unsigned = false) {
  const auto admitted = admit_replay(recording, accept_unsigned);
  return admitted ? "" : admitted.error().what;
}

TEST(Replay, ARecordingOfNobodyKnownIsPlayedOnlyWhenAskedToAndAChangedOneNever) {
  const char* const before = ::getenv("BIRDSEYE_IDENTITY");
  const std::string own = before == nullptr ? "" : before;
  const Scratch scratch;
  be(scratch / "cart");
  RecordConfig config;
  config.folder = scratch / "r";
  std::filesystem::path path;
  {
    const auto recorder = Recorder::start(config, {});
    ASSERT_TRUE(recorder) << recorder.error().what;
    path = (*recorder)->path();
    for (std::uint8_t i = 0; i < 9; ++i) (*recorder)->take(TrackerBytes{{{0x80, i}, DeviceTime{i}}});
  }
  EXPECT_EQ(refusal(path), "");
  const std::string text = contents_of(path);
  std::string changed = text;
  changed[text.size() / 2] = static_cast<char>(changed[text.size() / 2] ^ 1);
  const std::string cut = scratch.file("cut.berec", text.substr(0, text.size() - 1));
  EXPECT_NE(refusal(cut).find("not signed"), std::string::npos) << refusal(cut);
  EXPECT_NE(refusal(cut).find("--accept-unsigned"), std::string::npos) << refusal(cut);
  EXPECT_EQ(refusal(cut, true), "");
  for (const bool accept : {false, true}) {
    EXPECT_NE(refusal(scratch.file("longer.berec", text + "x"), accept), "") << accept;
    EXPECT_NE(refusal(scratch.file("changed.berec", changed), accept), "") << accept;
  }
  be(scratch / "another");
  EXPECT_NE(refusal(path).find("not known here"), std::string::npos) << refusal(path);
  EXPECT_EQ(refusal(path, true), "");
  own.empty() ? ::unsetenv("BIRDSEYE_IDENTITY") : ::setenv("BIRDSEYE_IDENTITY", own.c_str(), 1);
}

TEST(Replay, AnEventThatIsAnHourLaterIsDamaged) {
  const Scratch scratch;
  RecordConfig config;
  config.folder = scratch / "r";
  std::filesystem::path path;
  {
    const auto recorder = Recorder::start(config, {});
    ASSERT_TRUE(recorder) << recorder.error().what;
    path = (*recorder)->path();
    for (const int at_s : {0, 3 * 3600})
      (*recorder)->take(TrackerBytes{{{0x80}, DeviceTime{} + Duration::from_seconds(at_s)}});
  }
  const auto server = *wire::Server::listen("127.0.0.1", 0);
  const auto played = replay(path, *server, {});
  ASSERT_FALSE(played);
  EXPECT_NE(played.error().what.find("3 h later"), std::string::npos) << played.error().what;
}

}  // namespace
}  // namespace birdseye::device
