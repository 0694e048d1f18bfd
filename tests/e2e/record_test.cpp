// `birdseye record` of the simulated cart, from the outside.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "drivers/system/clock.hpp"
#include "host/files/pose_files.hpp"
#include "host/recording/recording_reader.hpp"
#include "tests/support/cart_script.hpp"
#include "tests/support/command.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;
using testing::expect_refused;
using testing::read_json;
using testing::Scratch;

/// Records three times at once: for four seconds, until Ctrl-C, until the appliance goes.
constexpr const char* kThreeAtOnce = R"(record="$bin/birdseye record --server $server"
$record --out film --video compressed > film.log 2>&1 &
film=$!
$record --out gone > gone.log 2>&1 &
gone=$!
$record --out timed --seconds 4 --json timed.json; echo "timed $?"
$record --out timed; echo "again $?"
kill -INT $film; wait $film; echo "film $?"
kill -KILL $appliance; wait $gone; echo "gone $?"
cat film.log gone.log
)";

struct Played {
  std::size_t frames = 0, birds = 0;
  std::size_t posed = 0;  ///< of the frames after the scope's first measurement: before it the scope has told no name
  std::string ending;
};

Played play(const fs::path& path) {
  Played played;
  bool scope_told = false;
  auto reader = host::RecordingReader::open(path, {});
  EXPECT_TRUE(reader) << reader.error().what;
  while (reader) {
    const auto event = (*reader)->next(Deadline::after(Duration::from_ms(20'000)));
    if (!event) {
      played.ending = event.error().what;
      EXPECT_EQ(event.error().code, Errc::disconnected) << played.ending;
      break;
    }
    if (!*event) continue;
    if (const auto* birds = std::get_if<wire::Birds>(&**event)) {
      ++played.birds;
      scope_told |= std::ranges::any_of(birds->birds, [](const auto& bird) { return bird.name == "scope"; });
    }
    const auto* frame = std::get_if<wire::VideoFrame>(&**event);
    if (frame == nullptr) continue;
    ++played.frames;
    played.posed += scope_told && frame->info.pose.tracker_from_sensor ? 1 : 0;
    EXPECT_EQ(frame->rgb->size(), 3U * 192 * 144);
  }
  return played;
}

TEST(RecordCommand, OfTheSimulatedCart) {
  const Scratch scratch;
  const auto found = testing::run_at_cart(scratch, {}, kThreeAtOnce);
  for (const char* line : {"timed 0", "again 2", "holds a recording already", "film 0", "gone 0", "it was interrupted",
                           "the appliance has gone"})
    EXPECT_NE(found.output.find(line), std::string::npos) << line << "\n" << found.output;

  const auto json = read_json(scratch / "timed.json");
  EXPECT_GE(json["seconds"], 3.9);
  EXPECT_GT(json["frames"], 50);
  EXPECT_GT(json["measurements"], 200);
  const Played timed = play(scratch / "timed");
  EXPECT_EQ(timed.frames, json["frames"].get<std::size_t>()) << timed.ending;
  EXPECT_EQ(timed.birds, json["measurements"].get<std::size_t>());
  EXPECT_GT(timed.posed, timed.frames / 2);
  const auto sheet = read_json(scratch / "timed/recording.json");
  EXPECT_EQ(sheet["why"], "4 s are over");
  EXPECT_EQ(sheet["instruments"][0]["identity"]["bird1_unit_serial"], "1001") << sheet["instruments"];
  // What calibrations read, and Slicer and PLUS open.
  const auto poses = host::read_pose_set(scratch / "timed/tracker.igs.mha", {"ScopeToTracker"});
  ASSERT_TRUE(poses) << poses.error().what;
  EXPECT_EQ(poses->poses.size(), json["poses"]["scope"].get<std::size_t>());
  const Played video = play(scratch / "timed/video.igs.mha");
  EXPECT_EQ(video.frames, timed.frames);
  EXPECT_EQ(video.posed, timed.posed);

  for (const char* name : {"film", "gone"}) {
    const Played played = play(scratch / name);
    EXPECT_GE(played.frames, timed.frames) << name << played.ending;
    EXPECT_EQ(read_json(scratch / name / "recording.json")["frames"], played.frames);
  }
}

TEST(RecordCommand, WithoutAnApplianceNothingIsWritten) {
  const Scratch scratch;
  expect_refused("birdseye", "record --server nowhere.invalid:1 --out " + (scratch / "r").string(), {"nowhere.invalid"},
                 scratch / "r");
  expect_refused("birdseye", "record --server 127.0.0.1:x --out " + (scratch / "r").string(), {"HOST:PORT"},
                 scratch / "r");
}

}  // namespace
}  // namespace birdseye
