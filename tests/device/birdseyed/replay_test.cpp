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

/// A recording of nine readings.
std::string recording_text(const std::filesystem::path& folder) {
  RecordConfig config;
  config.folder = folder;
  std::filesystem::path path;
  {
    const auto recorder = Recorder::start(config, {});
    if (!recorder) return "";
    path = (*recorder)->path();
    for (std::uint8_t i = 0; i < 9; ++i) (*recorder)->take(TrackerBytes{{{0x80, i}, DeviceTime{i}}});
  }
  return contents_of(path);
}

TEST(Replay, ARecordingOfNobodyKnownIsPlayedOnlyWhenAskedToAndAChangedOneNever) {
  const char* const before = ::getenv("BIRDSEYE_IDENTITY");
  const std::string own = before == nullptr ? "" : before;
  const Scratch scratch;
  be(scratch / "cart");
  const std::string text = recording_text(scratch / "r");
  const std::string path = scratch.file("whole.berec", text);
  EXPECT_EQ(refusal(path), "");
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

TEST(Replay, NoBitOfASignatureMakesARecordingOneThatNobodySigned) {
  const Scratch scratch;
  const std::string text = recording_text(scratch / "r");
  const std::size_t payload = text.rfind("{\"key\":");
  ASSERT_NE(payload, std::string::npos);
  ASSERT_EQ(refusal(scratch.file("whole.berec", text)), "");
  constexpr std::size_t kHead = 12;
  for (std::size_t at = payload - kHead; at < text.size(); ++at) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      std::string changed = text;
      changed[at] = static_cast<char>(static_cast<unsigned char>(changed[at]) ^ 1U << bit);
      const std::string why = refusal(scratch.file("changed.berec", changed), true);
      EXPECT_NE(why.find("damaged"), std::string::npos) << at - payload << " " << bit << why;
    }
  }
  // What was cut in its signature, as by a crash, is good up to there.
  for (std::size_t at = payload - kHead; at < text.size(); ++at)
    EXPECT_EQ(refusal(scratch.file("cut.berec", text.substr(0, at)), true), "") << at - payload;
}

TEST(Replay, ARecordingThatIsChangedBetweenAdmissionAndItsEndEndsWithAnError) {
  const Scratch scratch;
  const std::string path = scratch.file("r.berec", recording_text(scratch / "r"));
  const auto admitted = admit_replay(path, false);
  ASSERT_TRUE(admitted) << admitted.error().what;
  const auto server = *wire::Server::listen("127.0.0.1", 0);
  EXPECT_TRUE(replay(path, *admitted, *server, {}));
  // One block less is as sound to the reader: nothing but the sum tells.
  const std::string text = contents_of(path);
  const Bytes eighth = block_of(RawEvent(TrackerBytes{{{0x80, 8}, DeviceTime{8}}}));
  const std::size_t at = text.find(std::string(eighth.begin(), eighth.end()));
  ASSERT_NE(at, std::string::npos);
  (void)scratch.file("r.berec", text.substr(0, at) + text.substr(at + eighth.size()));
  const auto played = replay(path, *admitted, *server, {});
  ASSERT_FALSE(played);
  EXPECT_NE(played.error().what.find("was changed, or still written, while it was played"), std::string::npos)
      << played.error().what;
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
  const auto played = replay(path, *admit_replay(path, false), *server, {});
  ASSERT_FALSE(played);
  EXPECT_NE(played.error().what.find("3 h later"), std::string::npos) << played.error().what;
}

}  // namespace
}  // namespace birdseye::device
