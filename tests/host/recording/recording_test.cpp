#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "device/wire/foreign_feed.hpp"
#include "drivers/system/clock.hpp"
#include "host/files/film.hpp"
#include "host/recording/event_lines.hpp"
#include "host/recording/recording_reader.hpp"
#include "host/recording/recording_writer.hpp"
#include "host/recording/sequence_writer.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/synced_files.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;
using testing::contents_of;
using testing::is_synced;
using testing::read_json;
using testing::Scratch;

wire::VideoFrame frame(int n, int width_px, int height_px) {
  std::mt19937 random(static_cast<unsigned>(n));
  std::vector<std::uint8_t> rgb(3 * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
  for (std::uint8_t& byte : rgb) byte = static_cast<std::uint8_t>(random());
  wire::VideoFrame out;
  out.info.sequence = 100 + static_cast<std::uint64_t>(n);
  out.info.acquired = {5'000'000'000'123 + 40'000'000LL * n};
  out.info.acquired_sigma = {70'123};
  out.info.arrived = {out.info.acquired.ns + 30'000'001};
  out.info.pose.reason = "the tracker is silent";
  if (n % 4 != 3) {
    out.info.pose.kind = PoseKind::interpolated;
    out.info.pose.reason = "";
    out.info.pose.position_sigma_mm = 0.1 + 1e-17 * n;
    out.info.pose.tracker_from_sensor =
        Transform<Tracker, Sensor>(rotation_exp(Eigen::Vector3d(0.1 * n, 1.0 / 3, 0)), Eigen::Vector3d(n, 2, 3.1));
  }
  out.width_px = width_px;
  out.height_px = height_px;
  out.rgb = std::make_shared<const std::vector<std::uint8_t>>(std::move(rgb));
  return out;
}

wire::Birds birds(int n) {
  const Transform<Tracker, Sensor> pose(rotation_exp(Eigen::Vector3d(0.3, 0.01 * n, 0)), Eigen::Vector3d(1, n, 0.7));
  wire::Birds out{{5'000'000'000'000 + 10'000'000LL * n}, {{"scope", pose}}};
  if (n % 5 != 0) out.birds.push_back({"pointer", pose});
  return out;
}

/// As an appliance tells: all kinds, in their order.
std::vector<wire::Event> session(int frames, int width_px = 16, int height_px = 12) {
  wire::Health health;
  health.state = "ready";
  health.instruments.push_back({"tracker", "running", "miniBIRD 800", 0, {{"serial", "4711"}}});
  health.clock.wall_minus_monotonic_ns = 1'700'000'000'000'000'000;
  std::vector<wire::Event> events = {wire::Status{true, "ready"}, wire::Calibration{false, "no record", ""}, health};
  for (int n = 0; n < frames; ++n) {
    for (int m = 0; m < 4; ++m) events.emplace_back(birds(4 * n + m));
    if (n == 1) events.emplace_back(wire::Doubt{{7}, "pointer", "it jumped"});
    if (n == 1) events.emplace_back(wire::ClockChange{{8}, "camera", "step", {9}, 0.5});
    if (n == 2) events.emplace_back(wire::Pedal{true, {77}});
    if (n == 2) events.emplace_back(wire::CameraControls{true, {"gain"}, {"focus"}});
    events.emplace_back(frame(n, width_px, height_px));
  }
  return events;
}

/// All that an event says, with its pixels.
std::string said(const wire::Event& event) {
  std::string text = event_line(event);
  if (const auto* f = std::get_if<wire::VideoFrame>(&event)) text.append(f->rgb->begin(), f->rgb->end());
  return text;
}

void record(const fs::path& folder, const std::vector<wire::Event>& events, RecordingSettings settings = {}) {
  settings.folder = folder;
  settings.source = "test";
  auto writer = RecordingWriter::create(settings);
  ASSERT_TRUE(writer) << writer.error().what;
  for (const wire::Event& event : events) {
    const auto added = (*writer)->add(event);
    ASSERT_TRUE(added) << added.error().what;
  }
  const auto finished = (*writer)->finish("the test is over");
  ASSERT_TRUE(finished) << finished.error().what;
}

struct Played {
  std::vector<wire::Event> events;
  Error ending;
  std::vector<std::string> notes;
};

Played play(const fs::path& path, const RecordingReader::Settings& settings = {}) {
  Played played;
  const auto reader = RecordingReader::open(path, settings);
  if (!reader) {
    played.ending = reader.error();
    return played;
  }
  for (;;) {
    auto event = (*reader)->next(Deadline::after(Duration::from_ms(5000)));
    if (!event) {
      played.ending = event.error();
      played.notes = (*reader)->notes();
      return played;
    }
    if (*event) played.events.push_back(**std::move(event));
  }
}

TEST(Recording, PlaysTheSameEventsInTheSameOrderToTheBit) {
  const auto events = session(6);
  for (const bool pair : {false, true}) {
    const Scratch scratch;
    record(scratch / "r", events, {.pair = pair});
    EXPECT_EQ(fs::exists(scratch / "r/video.igs.mha"), !pair);
    const Played played = play(scratch / "r");
    EXPECT_EQ(played.ending.code, Errc::disconnected);
    EXPECT_NE(played.ending.what.find("6 frames"), std::string::npos) << played.ending.what;
    EXPECT_TRUE(played.notes.empty());
    ASSERT_EQ(played.events.size(), events.size());
    for (std::size_t i = 0; i < events.size(); ++i) EXPECT_EQ(said(played.events[i]), said(events[i])) << i;
  }
}

TEST(Recording, IsOnTheDiskOnceItHasEnded) {
  for (const RecordingSettings& settings : {RecordingSettings{}, {.pair = true}, {.compressed = true}}) {
    const Scratch scratch;
    testing::forget_synced();
    record(scratch / "made/r", session(6), settings);
    EXPECT_TRUE(is_synced(scratch.path())) << "both folders are new";
    EXPECT_TRUE(is_synced(scratch / "made")) << "or the folder is not there after a power cut";
    EXPECT_TRUE(is_synced(scratch / "made/r"));
    std::size_t files = 0;
    for (const auto& entry : fs::directory_iterator(scratch / "made/r")) {
      EXPECT_TRUE(is_synced(entry.path())) << entry.path();
      ++files;
    }
    EXPECT_EQ(files, settings.pair ? 5U : 4U);  // sheet, events, tracker, video
  }
}

TEST(Recording, ItsSheetSaysWhatIsInIt) {
  const Scratch scratch;
  auto events = session(6);
  events.erase(events.begin() + 10);  // some measurement
  std::erase_if(events, [](const wire::Event& e) {
    const auto* f = std::get_if<wire::VideoFrame>(&e);
    return f != nullptr && f->info.sequence == 103;
  });
  record(scratch / "r", events);
  const auto sheet = read_json(scratch / "r/recording.json");
  EXPECT_EQ(sheet["ended"], true);
  EXPECT_EQ(sheet["why"], "the test is over");
  EXPECT_EQ(sheet["frames"], 5);
  EXPECT_EQ(sheet["frames_missing"], 1);
  EXPECT_EQ(sheet["tracker"]["measurements"], 23);
  EXPECT_EQ(sheet["video"][0]["file"], "video.igs.mha");
  EXPECT_EQ(sheet["instruments"][0]["identity"]["serial"], "4711");
  EXPECT_EQ(sheet["clock"]["wall_minus_monotonic_ns"], 1'700'000'000'000'000'000);
}

TEST(Recording, ASequenceAloneIsPlayedToo) {
  const Scratch scratch;
  const auto events = session(6);
  record(scratch / "r", events);
  const Played played = play(scratch / "r/video.igs.mha");
  EXPECT_EQ(played.ending.code, Errc::disconnected) << played.ending.what;
  std::vector<wire::VideoFrame> frames;
  std::size_t pointers = 0;
  for (const wire::Event& event : played.events) {
    if (const auto* f = std::get_if<wire::VideoFrame>(&event)) frames.push_back(*f);
    if (const auto* b = std::get_if<wire::Birds>(&event)) {
      for (const wire::Bird& bird : b->birds) pointers += bird.name == "pointer" ? 1 : 0;
    }
  }
  ASSERT_EQ(frames.size(), 6U);
  EXPECT_GT(pointers, 4U);
  for (int n = 0; n < 6; ++n) {
    const wire::VideoFrame want = frame(n, 16, 12);
    const wire::VideoFrame& got = frames[static_cast<std::size_t>(n)];
    EXPECT_EQ(*got.rgb, *want.rgb);
    EXPECT_EQ(got.info.sequence, want.info.sequence);
    EXPECT_EQ(got.info.acquired.ns, want.info.acquired.ns);
    ASSERT_EQ(got.info.pose.tracker_from_sensor.has_value(), want.info.pose.tracker_from_sensor.has_value());
    if (want.info.pose.tracker_from_sensor) {
      EXPECT_TRUE(got.info.pose.tracker_from_sensor->matrix().isApprox(want.info.pose.tracker_from_sensor->matrix()));
    } else {
      EXPECT_EQ(got.info.pose.reason, "ScopeToTracker INVALID");
    }
  }
  const Played other = play(scratch / "r/video.igs.mha", {.transform = "ProbeToTracker"});
  EXPECT_NE(other.ending.what.find("PointerToTracker, ScopeToTracker"), std::string::npos) << other.ending.what;
}

/// Numbers that no time and no count can be: what they would be turned into is undefined. A sigma that is none is as
/// one that nobody told: the time is as uncertain as that of another program's server, never certain.
TEST(Recording, ASequencesTimesAndNumbersThatCannotBeAreAbsent) {
  const Scratch scratch;
  record(scratch / "r", session(2));
  const auto played_with = [&](const std::string& field, const std::string& number) {
    std::string text = contents_of(scratch / "r/video.igs.mha");
    const std::string key = "Seq_Frame0000_" + field + " = ";
    const auto value = text.find(key) + key.size();
    EXPECT_GT(value, key.size()) << field;
    text.replace(value, text.find('\n', value) - value, number);
    return play(scratch.file("other.igs.mha", text));
  };
  const auto first_frame = [](const Played& played) {
    for (const wire::Event& event : played.events)
      if (const auto* f = std::get_if<wire::VideoFrame>(&event)) return f->info;
    return wire::FrameInfo{};
  };
  for (const std::string number : {"1e38", "-1e38", "1e300"}) {
    EXPECT_EQ(first_frame(played_with("FrameNumber", number)).sequence, 0U) << number;
    EXPECT_EQ(first_frame(played_with("TimestampSigma", number)).acquired_sigma.ns, wire::kForeignStampSigma.ns)
        << number;
    const Played untimed = played_with("Timestamp", number);
    EXPECT_EQ(first_frame(untimed).sequence, frame(1, 16, 12).info.sequence) << "frame 0 is passed over";
    ASSERT_EQ(untimed.notes.size(), 1U);
    EXPECT_NE(untimed.notes[0].find("frame 0 has no time"), std::string::npos) << untimed.notes[0];
  }
}

/// What video.igs.mha says of the transforms of frame 4, where only one bird has told its name before.
std::string transforms_after(const std::string& bird, const Eigen::Vector3d& off_mm) {
  const Scratch scratch;
  const wire::VideoFrame posed = frame(4, 16, 12);
  const Transform<Tracker, Sensor>& pose = *posed.info.pose.tracker_from_sensor;
  std::vector<wire::Event> events;
  for (int n = -4; n < 4; ++n) {
    events.emplace_back(wire::Birds{posed.info.acquired + Duration::from_ms(10 * n),
                                    {{bird, {pose.rotation(), pose.translation() + off_mm}}}});
  }
  events.emplace_back(posed);
  record(scratch / "r", events);
  const Played played = play(scratch / "r/video.igs.mha", {.transform = transform_name(bird)});
  for (const wire::Event& event : played.events) {
    const auto* f = std::get_if<wire::VideoFrame>(&event);
    if (f == nullptr) continue;
    if (!f->info.pose.tracker_from_sensor) return f->info.pose.reason;
    return f->info.pose.tracker_from_sensor->matrix().isApprox(pose.matrix()) ? "the frame's" : "the bird's own";
  }
  return played.ending.what;
}

TEST(Recording, APoseOfAFrameIsOfNoBirdButTheOneThatItAgreesWith) {
  EXPECT_EQ(transforms_after("scope", {0, 300, 0}), "the frame's") << "the scope by name";
  EXPECT_EQ(transforms_after("probe", {0, 0.4, 0}), "the frame's") << "the only bird, with no scope beside it";
  EXPECT_EQ(transforms_after("pointer", {0, 300, 0}), "the bird's own") << "the scope has not told its name yet";
}

TEST(Recording, ACompressedOneHasAllFramesAndAllEvents) {
  const Scratch scratch;
  auto events = session(8, 64, 48);
  for (wire::Event& event : events) {  // flat pictures, that compression leaves alone
    auto* f = std::get_if<wire::VideoFrame>(&event);
    if (f == nullptr) continue;
    const auto grey = static_cast<std::uint8_t>(20 * (f->info.sequence - 100) + 40);
    f->rgb = std::make_shared<const std::vector<std::uint8_t>>(f->rgb->size(), grey);
  }
  record(scratch / "r", events, {.compressed = true});
  EXPECT_TRUE(fs::exists(scratch / "r/video.mp4"));
  const Played played = play(scratch / "r");
  ASSERT_EQ(played.events.size(), events.size()) << played.ending.what;
  for (std::size_t i = 0; i < events.size(); ++i) {
    EXPECT_EQ(event_line(played.events[i]), event_line(events[i])) << i;
    const auto* f = std::get_if<wire::VideoFrame>(&played.events[i]);
    if (f == nullptr) continue;
    EXPECT_NEAR((*f->rgb)[3000], (*std::get<wire::VideoFrame>(events[i]).rgb)[3000], 4) << i;
  }
}

/// A compressed recording of 8 frames of 64x48.
void record_film(const fs::path& folder) {
  record(folder, session(8, 64, 48), {.compressed = true});
  ASSERT_TRUE(fs::exists(folder / "video.mp4"));
}

void put_film(const fs::path& path, int width_px, int height_px, int frames) {
  auto film = Film::open(path, width_px, height_px, 25);
  ASSERT_TRUE(film) << film.error().what;
  for (int n = 0; n < frames; ++n) ASSERT_TRUE(film->add(*frame(n, width_px, height_px).rgb));
  ASSERT_TRUE(film->finish());
}

TEST(Recording, AFilmOfAnotherSizeThanItsEventsIsRefused) {
  const Scratch scratch;
  record_film(scratch / "r");
  put_film(scratch / "r/video.mp4", 48, 64, 8);
  const Played other = play(scratch / "r");
  EXPECT_EQ(other.ending.code, Errc::bad_value);
  for (const char* word : {"video.mp4", "48x64 px", "64x48 px"})
    EXPECT_NE(other.ending.what.find(word), std::string::npos) << other.ending.what;
  std::ofstream(scratch / "r/video.mp4") << "no film";
  const Played none = play(scratch / "r");
  EXPECT_EQ(none.ending.code, Errc::unreadable);
  EXPECT_NE(none.ending.what.find("video.mp4"), std::string::npos) << none.ending.what;
  put_film(scratch / "r/video.mp4", 64, 48, 3);
  const Played cut = play(scratch / "r");
  EXPECT_NE(cut.ending.what.find("3 frames are whole, 5 more"), std::string::npos) << cut.ending.what;
}

TEST(Recording, AFrameOfAnotherSizeThanItsFilmIsRefused) {
  const Scratch scratch;
  record_film(scratch / "r");
  const std::string lines = contents_of(scratch / "r/events.jsonl"), told = "\"width_px\":64";
  const auto last = lines.rfind(told);
  ASSERT_NE(last, std::string::npos);
  const auto put = [&](std::size_t at, const std::string& width) {
    std::ofstream(scratch / "r/events.jsonl") << std::string(lines).replace(at, told.size(), "\"width_px\":" + width);
  };
  put(last, "1024");
  const Played larger = play(scratch / "r");
  EXPECT_EQ(larger.ending.code, Errc::bad_format);
  EXPECT_NE(larger.ending.what.find("frame 7 is said to be 1024x48, and the file of its pixels is 64x48"),
            std::string::npos)
      << larger.ending.what;
  for (const char* width : {"-64", "0", "2000000000"}) {
    put(lines.find(told), width);
    const Played none = play(scratch / "r");
    EXPECT_EQ(none.ending.code, Errc::bad_value) << width;
    EXPECT_NE(none.ending.what.find("video.mp4"), std::string::npos) << none.ending.what;
  }
}

TEST(Recording, FramesThatAreTooLargeToPlayAreNotRecorded) {
  const Scratch scratch;
  auto writer = RecordingWriter::create({.folder = scratch / "r", .source = "test"});
  ASSERT_TRUE(writer) << writer.error().what;
  wire::VideoFrame large = frame(0, 16, 12);
  large.width_px = 4096;
  large.height_px = 4097;
  const auto added = (*writer)->add(large);
  ASSERT_FALSE(added);
  EXPECT_NE(added.error().what.find("4096x4097 px"), std::string::npos) << added.error().what;
}

TEST(Recording, AnotherSizeBeginsAnotherFile) {
  const Scratch scratch;
  auto events = session(2);
  events.emplace_back(frame(2, 20, 10));
  record(scratch / "r", events);
  EXPECT_TRUE(fs::exists(scratch / "r/video-2.igs.mha"));
  const Played played = play(scratch / "r");
  ASSERT_EQ(played.events.size(), events.size()) << played.ending.what;
  EXPECT_EQ(said(played.events.back()), said(events.back()));
}

TEST(Recording, EndsWhereFramesHaveAnotherSizeAgainAndAgain) {
  for (const bool compressed : {false, true}) {
    const Scratch scratch;
    const RecordingSettings settings{.folder = scratch / "r", .source = "test", .compressed = compressed};
    auto writer = RecordingWriter::create(settings);
    ASSERT_TRUE(writer) << writer.error().what;
    int n = 0;
    Result<void> added;
    for (; n < 100 && added; ++n) added = (*writer)->add(frame(n, n % 2 == 0 ? 16 : 32, 12));
    ASSERT_FALSE(added);
    EXPECT_NE(added.error().what.find("21 sizes, one after another"), std::string::npos) << added.error().what;
    EXPECT_EQ((*writer)->figures().videos.size(), 20U);
  }
}

TEST(Recording, OneThatWasCutPlaysWhatIsWhole) {
  const Scratch scratch;
  {
    // The program ends without finish(), as by a signal that cannot be caught.
    auto writer = RecordingWriter::create({.folder = scratch / "r", .source = "test"});
    ASSERT_TRUE(writer) << writer.error().what;
    for (const wire::Event& event : session(5)) ASSERT_TRUE((*writer)->add(event));
  }
  Played played = play(scratch / "r");
  EXPECT_EQ(played.ending.code, Errc::disconnected);
  EXPECT_EQ(played.events.size(), session(5).size());
  ASSERT_EQ(played.notes.size(), 1U);
  EXPECT_NE(played.notes[0].find("cut short"), std::string::npos);
  // Less of the pixels, and half a line.
  fs::resize_file(scratch / "r/video.raw", 3 * 3 * 16 * 12 + 5);
  fs::resize_file(scratch / "r/events.jsonl", fs::file_size(scratch / "r/events.jsonl") - 9);
  played = play(scratch / "r");
  EXPECT_NE(played.ending.what.find("3 frames are whole, 1 more"), std::string::npos) << played.ending.what;
  EXPECT_EQ(played.notes.size(), 2U);
}

TEST(Recording, DamageIsNamed) {
  const Scratch scratch;
  record(scratch / "r", session(2));
  const std::string lines = contents_of(scratch / "r/events.jsonl");
  const auto expect = [&](const std::vector<std::string>& words) {
    const Played played = play(scratch / "r");
    EXPECT_NE(played.ending.code, Errc::disconnected);
    for (const std::string& word : words)
      EXPECT_NE(played.ending.what.find(word), std::string::npos) << word << "\n" << played.ending.what;
  };
  const auto put = [&](const std::string& text) { std::ofstream(scratch / "r/events.jsonl") << text; };
  for (const char* damaged : {"{\"Pedal", "{\"Birds\":{}}", "{\"Birds\":7}", "{\"Status\":{\"ok\":1,\"text\":2}}"}) {
    put(damaged + ("\n" + lines));
    expect({"events.jsonl: line 1: is no event: ", "; take a copy of the recording"});
    EXPECT_EQ(play(scratch / "r").ending.what.find("exception"), std::string::npos) << "the parser's own words";
  }
  put("{}\n" + lines);
  expect({"events.jsonl", "line 1"});
  put(std::string((std::size_t{1} << 20U) + 1, '{') + lines);
  expect({"events.jsonl: line 1 is longer than any event"});
  put("{\"Sound\":{}}\n" + lines);
  expect({"line 1", "Sound"});
  put("{\"Birds\":{\"acquired_ns\":1,\"birds\":[{\"name\":\"scope\",\"tracker_from_sensor\":[2,0,0,0,0,1,0,0,0,0,1,0,0,"
      "0,0,1]}]}}\n" +
      lines);
  expect({"line 1", "no pose"});
  put(lines);
  fs::rename(scratch / "r/video.igs.mha", scratch / "r/other.igs.mha");
  expect({"lacks the video", "video.igs.mha"});
  std::ofstream(scratch / "r/recording.json") << "{\"birdseye_recording\": 2}";
  expect({"recording.json", "another version"});
  fs::remove(scratch / "r/events.jsonl");
  expect({"holds no recording"});
  EXPECT_EQ(play(scratch / "none").ending.code, Errc::not_found);
  EXPECT_EQ(RecordingWriter::create({.folder = scratch / "r", .source = ""}).error().code, Errc::in_use);
}

/// Changes the header of a video, whose pixels stay as they are.
void change_header(const fs::path& video, const std::string& from, const std::string& to) {
  std::string text = contents_of(video);
  const auto at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  std::ofstream(video) << text.replace(at, from.size(), to);
}

TEST(Recording, AVideoOfAnotherSessionIsNotPlayedWithTheEvents) {
  const auto later = [](std::uint64_t frames, std::int64_t ns) {
    auto events = session(4);
    for (wire::Event& event : events) {
      auto* f = std::get_if<wire::VideoFrame>(&event);
      if (f == nullptr) continue;
      f->info.sequence += frames;
      f->info.acquired.ns += ns;
    }
    return events;
  };
  for (const bool pair : {false, true}) {
    for (const auto& [frames, ns] : {std::pair{1U, 0}, {0U, 1'000'000}, {74U, 1'000'000'000}}) {
      const Scratch scratch;
      record(scratch / "r", session(4), {.pair = pair});
      record(scratch / "other", later(frames, ns), {.pair = pair});
      for (const char* file : {"video.igs.mha", "video.igs.mhd", "video.raw"}) {
        if (fs::exists(scratch / "other" / file)) fs::rename(scratch / "other" / file, scratch / "r" / file);
      }
      const Played played = play(scratch / "r");
      EXPECT_EQ(played.ending.code, Errc::bad_format);
      EXPECT_NE(played.ending.what.find("the pictures of video are not those of its events: frame 0 is number 100 of "
                                        "5000.000000123 s in events.jsonl"),
                std::string::npos)
          << played.ending.what;
      for (const wire::Event& event : played.events) EXPECT_FALSE(std::holds_alternative<wire::VideoFrame>(event));
    }
  }
}

TEST(Recording, WhatAVideoDoesNotSayOfItsFramesIsNotComparedAndATextMayBeRounded) {
  const Scratch scratch;
  record(scratch / "r", session(3));
  const std::string whole = contents_of(scratch / "r/video.igs.mha");
  const auto frames_with = [&](const std::string& from, const std::string& to) {
    std::ofstream(scratch / "r/video.igs.mha") << whole;
    change_header(scratch / "r/video.igs.mha", from, to);
    return play(scratch / "r").ending.what;
  };
  for (const auto& [from, to] : {std::pair{"Seq_Frame0001_FrameNumber", "Seq_Frame0001_OtherNumber"},
                                 {"Seq_Frame0001_Timestamp ", "Seq_Frame0001_Stamp "},
                                 {"Seq_Frame0001_ImageStatus", "Seq_Frame0001_OtherStatus"},
                                 {"Seq_Frame0001_Timestamp = 5000.040000123", "Seq_Frame0001_Timestamp = 5000.04"}})
    EXPECT_NE(frames_with(from, to).find("; 3 frames"), std::string::npos) << from << "\n" << frames_with(from, to);
  const std::string invalid = frames_with("Seq_Frame0001_ImageStatus = OK", "Seq_Frame0001_ImageStatus = INVALID");
  EXPECT_NE(invalid.find("2 frames are whole, 1 more"), std::string::npos) << invalid;
  const std::string grey = frames_with("ElementNumberOfChannels = 3", "ElementNumberOfChannels = 1");
  EXPECT_NE(grey.find("has more pixels than its header tells of"), std::string::npos) << grey;
  const std::string untimed = frames_with("Seq_Frame0001_Timestamp = 5", "Seq_Frame0001_Timestamp = x");
  EXPECT_NE(untimed.find("there it is number 101 of x"), std::string::npos) << untimed;
}

/// What such a number is turned into is undefined, and so is the difference of times that are farther apart than a
/// clock can count.
TEST(Recording, ATimeThatIsNoWholeNumberOrCannotBeIsDamage) {
  EXPECT_TRUE(parse_event_line(R"({"Doubt":{"acquired_ns":12,"bird":"scope","why":""}})"));
  for (const std::string time :
       {"1.5", "1e67", "1e2", "true", "99999999999999999999", "9223372036854775807", "-2305843009213693953"}) {
    const auto read = parse_event_line(R"({"Doubt":{"acquired_ns":)" + time + R"(,"bird":"scope","why":""}})");
    EXPECT_FALSE(read) << time;
  }
}

TEST(Recording, AtItsPaceAnEventWaitsForItsTime) {
  const Scratch scratch;
  record(scratch / "r", session(50));  // two seconds
  const auto reader = RecordingReader::open(scratch / "r", {.speed = 1e-3});
  ASSERT_TRUE(reader);
  const auto now = host_now();
  int events = 0;
  for (int i = 0; i < 100; ++i) {
    const auto event = (*reader)->next(now);
    ASSERT_TRUE(event);
    events += *event ? 1 : 0;
  }
  EXPECT_EQ(events, 4);  // status, calibration, health and the first measurement: the second is 10 s away
}

}  // namespace
}  // namespace birdseye::host
