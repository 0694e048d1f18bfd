// `birdseye record` of the simulated cart, from the outside.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "calibration/record/field_map_file.hpp"
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

/// Moves nothing, anywhere about the cart.
calibration::FieldMap flat_map() {
  calibration::FieldMapData data;
  data.functions.low_mm = {-3000, -3000, -3000};
  data.functions.high_mm = {3000, 3000, 3000};
  data.position_mm.assign(4, Eigen::Vector3d::Zero());
  data.rotation_rad.assign(4, Eigen::Vector3d::Zero());
  data.sigma_mm.assign(9 * 9 * 9, 0.1);
  return *calibration::FieldMap::from(std::move(data));
}

/// What is asked of an appliance that corrects its poses by a map that nobody signed, and of what it and we record
/// there.
constexpr const char* kOfAnUnsignedMap =
    R"(said() { name=$1; shift; "$@" > $name.log 2>&1; echo "$name $?"; cat $name.log; }
said check $bin/birdseyed --config cart.toml --check
said doctor $bin/birdseye doctor --server $server
said record $bin/birdseye record --server $server --out kept --seconds 3
said live_tip $bin/birdseye calibrate tip --server $server --bird pointer --seconds 3 --out t.txt
tip="$bin/birdseye calibrate tip --recording kept --tool PointerToTracker --out t.txt"
said refused $tip
said verify $bin/birdseye verify kept
said accepted $tip --accept-unsigned
kill -TERM $appliance; wait $appliance
recorded=$(echo rec/*.berec)
said verify_raw $bin/birdseye verify $recorded
said replay $bin/birdseyed --config cart.toml --replay $recorded
$bin/birdseyed --config cart.toml --replay $recorded --accept-unsigned > replay_on.log 2>&1 &
for n in $(seq 100); do grep -q 'replaying on' replay_on.log && break; sleep 0.1; done
said replayed_tip $bin/birdseye calibrate tip --server $server --bird pointer --seconds 3 --out t.txt
cat replay_on.log
)";

TEST(RecordCommand, OfPosesThatAnUnsignedMapCorrectedSaysSoWhereverTheyGo) {
  const Scratch scratch;
  const std::string map = scratch.file(
      "field.json", calibration::field_map_text(flat_map(), {"2026-11-22T09:30:00Z", "birdseye", "180 places"}));
  const auto found = testing::run_at_cart(
      scratch,
      {.sections = "[calibration]\nfield = \"" + map + "\"\naccept_unsigned = true\n[record]\nfolder = \"" +
                   (scratch / "rec").string() + "\"\n"},
      kOfAnUnsignedMap);
  constexpr const char* kMap = "map of the field is not signed";
  const auto part = [&found](const std::string& from, const std::string& to) {
    const std::string all = "\n" + found.output;
    const std::size_t at = all.find("\n" + from);
    return at == std::string::npos ? "" : all.substr(at, all.find("\n" + to, at) - at);
  };
  const auto expect_part = [&](const std::string& from, const std::string& to, const std::vector<std::string>& words) {
    for (const std::string& word : words)
      EXPECT_NE(part(from, to).find(word), std::string::npos) << from << ": " << word;
  };
  expect_part("check 0", "doctor", {"UNSIGNED: the ", kMap, "cart.toml: sound"});
  expect_part("doctor", "record", {kMap, "docs/manual/signatures.md"});
  expect_part("record 0", "live_tip",
              {"UNSIGNED: the poses rest on what no known machine signed", kMap, "verdict: marginal"});
  expect_part("live_tip 2", "refused", {kMap, "--accept-unsigned"});
  expect_part("refused 2", "verify", {"rests on what no known machine signed", kMap});
  expect_part("verify 3", "accepted", {"rests on what no known machine had signed", kMap});
  expect_part("accepted", "verify_raw", {"UNSIGNED: the recording is made of what no known machine signed", kMap});
  expect_part("verify_raw 3", "replay", {"rests on what no known machine had signed", kMap});
  expect_part("replay 2", "replayed_tip", {"rests on what no known machine signed", kMap});
  expect_part("replayed_tip 2", "no such line", {kMap, "--accept-unsigned", "UNSIGNED: "});
  if (HasFailure()) std::cout << found.output;
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
