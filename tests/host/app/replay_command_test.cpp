#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "host/files/registration_file.hpp"
#include "host/operation/decision_log.hpp"
#include "host/operation/operation.hpp"
#include "host/operation/snapshot.hpp"
#include "host/overlay/ct_sha256.hpp"
#include "host/recording/recording_writer.hpp"
#include "host/volume/import.hpp"
#include "tests/support/command.hpp"
#include "tests/support/example_record.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/small_ct.hpp"
#include "tests/support/this_machine.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;
using testing::contents_of;
using testing::ct_of_tissue;
using testing::expect_refused;
using testing::read_json;
using testing::run;
using testing::Scratch;
using testing::small_ct;

constexpr const char* kIdentityPose = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
constexpr const char* kReplayCamera =
    "%YAML:1.0\n---\nimage_width: 64\nimage_height: 48\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: "
    "d\n   data: [ 60., 0., 32., 0., 60., 24., 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 1\n   "
    "cols: 5\n   dt: d\n   data: [ -0.1, 0., 0., 0., 0. ]\n";
constexpr int kFrames = 24, kLost = 12;

/// small_ct's ball, which the pointer touches at four places, then the scope looks at from 80 mm; from frame kLost on
/// there is no pose.
void record(const fs::path& folder) {
  auto writer =
      host::RecordingWriter::create({.folder = folder, .source = "test", .machine = testing::authors().machine});
  ASSERT_TRUE(writer) << writer.error().what;
  std::int64_t ns = 1'000'000'000;
  const auto pointer_at = [&](const Eigen::Vector3d& place, double seconds) {
    for (int n = 0; n < seconds * 100; ++n, ns += 10'000'000) {
      const Transform<Tracker, Sensor> pose(Eigen::Matrix3d::Identity(), place);
      ASSERT_TRUE((*writer)->add(wire::Birds{{ns}, {{"pointer", pose}}}));
    }
  };
  const std::vector<Eigen::Vector3d> places = {{100, 0, 0}, {0, 0, 0},   {30, 0, 0},
                                               {0, 50, 0},  {10, 0, 70}, {100, 0, 0}};
  for (std::size_t i = 0; i < places.size(); ++i) {
    pointer_at(places[i], 0.8);
    for (int n = 1; i + 1 < places.size() && n < 20; ++n)
      pointer_at(places[i] + (places[i + 1] - places[i]) * (n / 20.0), 0.02);
  }
  for (int n = 0; n < kFrames; ++n) {
    wire::VideoFrame frame;
    frame.info.sequence = static_cast<std::uint64_t>(n) + 7;
    frame.info.acquired = frame.info.arrived = {ns + 40'000'000 * n};
    frame.width_px = 64;
    frame.height_px = 48;
    frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(3 * 64 * 48, static_cast<std::uint8_t>(20 + n));
    if (n < kLost) {
      frame.info.pose.kind = PoseKind::interpolated;
      frame.info.pose.tracker_from_sensor =
          Transform<Tracker, Sensor>(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.3 * n, 0, -80));
    } else {
      frame.info.pose.reason = "the tracker is silent";
    }
    ASSERT_TRUE((*writer)->add(frame));
  }
  ASSERT_TRUE((*writer)->finish("done"));
}

/// The bytes of every file in a folder, by name.
std::map<std::string, std::string> contents(const fs::path& folder) {
  std::map<std::string, std::string> out;
  for (const auto& entry : fs::directory_iterator(folder)) out[entry.path().filename()] = contents_of(entry.path());
  return out;
}

std::string inputs(const Scratch& scratch, const std::string& ct) {
  return "replay " + (scratch / "r").string() + " --volume " + ct + " --transfer abdomen --camera " +
         scratch.file("camera.yaml", kReplayCamera) + " --camera-from-sensor " +
         scratch.file("hand_eye.txt", kIdentityPose);
}

TEST(ReplayCommand, TwoReplaysAreTheSameToTheBit) {
  const Scratch scratch;
  record(scratch / "r");
  const std::string arguments = inputs(scratch, small_ct(scratch)) + " --registration " +
                                scratch.file("reg.txt", kIdentityPose) + " --every 4 --out ";
  for (const char* name : {"a", "b"}) {
    const auto result = run("birdseye", arguments + (scratch / name).string());
    ASSERT_EQ(result.code, 0) << result.output;
    EXPECT_NE(result.output.find("fiducial registration error (FRE): not known\n"), std::string::npos);
    EXPECT_NE(result.output.find("wrote " + (scratch / name / "frames.csv").string()), std::string::npos);
    EXPECT_NE(result.output.find("; 6 pictures " + (scratch / name / "overlay-*.png").string()), std::string::npos);
  }
  const auto a = contents(scratch / "a"), b = contents(scratch / "b");
  EXPECT_EQ(a.size(), 6U + 3U);  // pictures; frames.csv, replay.json, patient_from_tracker.txt
  EXPECT_TRUE(a == b);
  const auto json = nlohmann::json::parse(a.at("replay.json"));
  EXPECT_EQ(json["frames"], kFrames);
  EXPECT_EQ(json["frames_overlaid"], kLost);
  EXPECT_EQ(json["reasons_of_frames"]["the tracker is silent"], kFrames - kLost);
  EXPECT_EQ(json["verdict"], "marginal");
  EXPECT_NE(json["reasons"].dump().find("the tracker is silent"), std::string::npos) << json["reasons"];
  // Without a pose there is the video and nothing else; with one there is the ball.
  const auto row = [&](int n) {
    std::istringstream table(a.at("frames.csv"));
    std::string line;
    for (int i = -1; i <= n; ++i) std::getline(table, line);
    return line;
  };
  EXPECT_NE(row(0).find("7,"), std::string::npos);
  EXPECT_NE(row(0).find(",interpolated,1,,"), std::string::npos) << row(0);
  EXPECT_NE(row(0).find(",,,,1 0 0"), std::string::npos) << row(0);  // no live window's decisions were given
  EXPECT_NE(row(kLost).find(",refused,0,the tracker is silent,"), std::string::npos) << row(kLost);
  EXPECT_GT(a.at("overlay-000007.png").size(), 2 * a.at("overlay-000023.png").size());
}

TEST(ReplayCommand, PicturesOfAnEarlierReplayAreRemovedAndNothingElse) {
  const Scratch scratch;
  record(scratch / "r");
  const fs::path out = scratch / "o";
  const std::string command = inputs(scratch, small_ct(scratch)) + " --registration " +
                              scratch.file("reg.txt", kIdentityPose) + " --out " + out.string();
  ASSERT_EQ(run("birdseye", command + " --every 4").code, 0);
  ASSERT_TRUE(fs::exists(out / "overlay-000011.png"));
  std::ofstream(out / "notes.txt") << "the user's own";
  const auto again = run("birdseye", command + " --every 23");
  ASSERT_EQ(again.code, 0) << again.output;
  EXPECT_FALSE(fs::exists(out / "overlay-000011.png"));
  const auto now = contents(out);
  EXPECT_EQ(now.size(), 2U + 3U + 1U);  // pictures; frames.csv, replay.json, patient_from_tracker.txt; notes.txt
  EXPECT_EQ(now.at("notes.txt"), "the user's own");
  std::ofstream(out / "overlay-000003.png") << "the user's own";
  expect_refused("birdseye", command, {"overlay-000003.png", "not of an earlier replay", "give another --out"});
  EXPECT_EQ(contents_of(out / "overlay-000003.png"), "the user's own");
}

TEST(ReplayCommand, SaysWhatTheLiveWindowDecidedThen) {
  const Scratch scratch;
  record(scratch / "r");
  auto log = host::DecisionLog::open(scratch / "live");
  ASSERT_TRUE(log);
  host::LoggedDecision then;
  then.sequence = 7;
  then.strength = 0.5;
  then.reason = "the picture is 170 ms old";
  then.said = "Fades: the picture is 170 ms old";
  log->add(then);
  ASSERT_TRUE(log->close());
  const std::string arguments = inputs(scratch, small_ct(scratch)) + " --registration " +
                                scratch.file("reg.txt", kIdentityPose) + " --out " + (scratch / "o").string() +
                                " --live-log ";
  const auto result = run("birdseye", arguments + (scratch / "live").string());
  ASSERT_EQ(result.code, 0) << result.output;
  std::istringstream table(contents_of(scratch / "o/frames.csv"));
  std::string header, first, second;
  std::getline(table, header);
  std::getline(table, first);
  std::getline(table, second);
  EXPECT_EQ(first.rfind("7,", 0), 0U) << first;
  EXPECT_NE(first.find(",0.500,the picture is 170 ms old,Fades: the picture is 170 ms old,1 0 0"), std::string::npos)
      << first;
  EXPECT_NE(second.find(",,,,1 0 0"), std::string::npos) << second;
  expect_refused("birdseye", arguments + scratch.file("other.csv", "a,b\n"), {"--live-log", "live --out"});
}

TEST(ReplayCommand, RegistersAnewByTheTouchesInTheRecording) {
  const Scratch scratch;
  record(scratch / "r");
  // The markers 5 mm to the side of where they were touched, in another order.
  const auto result = run("birdseye", inputs(scratch, ct_of_tissue(scratch)) + " --fiducials " +
                                          scratch.file("ct.txt", "5 50 0\n5 0 0\n15 0 70\n35 0 0\n") + " --tip " +
                                          scratch.file("tip.txt", "0 0 0\n") + " --out " + (scratch / "o").string());
  ASSERT_EQ(result.code, 0) << result.output;
  const auto json = read_json(scratch / "o/replay.json");
  EXPECT_EQ(json["touches"], 4);
  EXPECT_LT(json["fre_mm"], 0.5);
  const auto kept = host::read_registration(scratch / "o/patient_from_tracker.txt");
  ASSERT_TRUE(kept) << kept.error().what;
  EXPECT_NEAR(kept->patient_from_tracker.matrix()(0, 0), 1, 1e-2);
  EXPECT_NEAR(kept->patient_from_tracker.matrix()(0, 3), 5, 0.5);
  EXPECT_EQ(kept->ct_sha256.size(), 64U);
}

TEST(ReplayCommand, WhatCannotBeReplayedIsRefused) {
  const Scratch scratch;
  record(scratch / "r");
  const std::string ct = small_ct(scratch), all = inputs(scratch, ct);
  const std::string out = " --out " + (scratch / "o").string();
  const std::string registration = " --registration " + scratch.file("reg.txt", kIdentityPose);
  const auto refused = [&](const std::string& arguments, const std::vector<std::string>& words) {
    expect_refused("birdseye", arguments + out, words, scratch / "o");
  };
  refused(all, {"give one registration"});
  refused(all + registration + " --tracker-from-patient " + scratch.file("t.txt", kIdentityPose),
          {"give one registration"});
  refused(all + " --tracker-from-patient " + scratch.file("patient_from_tracker.txt", kIdentityPose),
          {"patient_from_tracker.txt", "by its name it is the inverse", "--registration"});
  refused("replay " + (scratch / "r").string() + " --volume " + ct + registration, {"no calibration was in force"});
  refused("replay " + (scratch / "none").string() + " --volume " + ct + registration, {"none", "no such recording"});
  refused("replay " + ct + " --volume " + ct + registration, {"holds no recording"});
  refused(all + " --fiducials " + scratch.file("f.txt", "0 0 0\n1 0 0\n0 1 0\n"), {"--tip"});
  refused(all + registration + " --deformation " + (scratch / "none.mha").string(), {"none.mha"});
}

TEST(ReplayCommand, AnErrorThatCannotBeStatesNothing) {
  const Scratch scratch;
  record(scratch / "r");
  const std::string all = inputs(scratch, small_ct(scratch)) + " --registration " +
                          scratch.file("reg.txt", kIdentityPose) + " --out " + (scratch / "o").string();
  for (const std::string option : {"--camera-rms-px", "--hand-eye-rms-px", "--fre-mm"}) {
    for (const std::string figure : {"-5", "nan", "inf", "1e300"})
      expect_refused("birdseye", all + " " + option + " " + figure, {option}, scratch / "o");
  }
  for (const std::string option : {"--camera-rms-px", "--hand-eye-rms-px"})
    expect_refused("birdseye", all + " " + option + " 0", {option + " 0: ", "above 0"}, scratch / "o");
  EXPECT_NE(run("birdseye", all + " --camera-rms-px 0.3 --hand-eye-rms-px 2 --fre-mm 0").code, 2);
}

/// Whoever replays by what was written says of it what was said of the first one.
TEST(ReplayCommand, WhatIsWrittenSaysNoMoreThanWhatWasGiven) {
  const Scratch scratch;
  record(scratch / "r");
  const std::string ct = small_ct(scratch), all = inputs(scratch, ct);
  const std::string caution = "does not say of which CT it is";
  const auto replayed = [&](const std::string& registration, const std::string& out) {
    const auto result =
        run("birdseye", all + " --registration " + registration + " --fre-mm 1 --out " + (scratch / out).string());
    EXPECT_NE(result.code, 2) << result.output;
    return result.output;
  };
  EXPECT_NE(replayed(scratch.file("reg.txt", kIdentityPose), "a").find(caution), std::string::npos);
  const std::string written = (scratch / "a/patient_from_tracker.txt").string();
  const auto of_nobody = host::read_registration(written);
  ASSERT_TRUE(of_nobody) << of_nobody.error().what;
  EXPECT_EQ(of_nobody->ct_sha256, "");
  EXPECT_FALSE(of_nobody->fre_mm);
  EXPECT_NE(replayed(written, "b").find(caution), std::string::npos);

  host::RegistrationFile found = *of_nobody;
  found.ct_sha256 = host::ct_sha256(*host::import_volume(ct));
  found.fre_mm = 0.5;
  EXPECT_EQ(replayed(scratch.file("found.txt", host::registration_text(found)), "c").find(caution), std::string::npos);
  const auto kept = host::read_registration(scratch / "c/patient_from_tracker.txt");
  ASSERT_TRUE(kept) << kept.error().what;
  EXPECT_EQ(kept->ct_sha256, found.ct_sha256);
  EXPECT_EQ(kept->fre_mm, found.fre_mm);
}

const calibration::Identity kBird{{"unit_serial", "4711"}}, kOtherBird{{"unit_serial", "4712"}};
const calibration::Identity kHead{{"serial", "A1"}}, kOtherHead{{"serial", "B2"}};

wire::Health health_of(const calibration::Identity& tracker, const calibration::Identity& camera) {
  wire::Health health;
  health.state = "ready";
  health.instruments = {{"tracker", "running", "", 0, tracker}, {"camera", "running", "", 0, camera}};
  return health;
}

/// Eight frames that look at small_ct's ball. Before each stands what an appliance tells then, if anything.
void record_told(const fs::path& folder, const std::map<int, std::vector<wire::Event>>& told) {
  auto writer =
      host::RecordingWriter::create({.folder = folder, .source = "test", .machine = testing::authors().machine});
  ASSERT_TRUE(writer) << writer.error().what;
  for (int n = 0; n < 8; ++n) {
    if (told.contains(n)) {
      for (const wire::Event& event : told.at(n)) ASSERT_TRUE((*writer)->add(event));
    }
    wire::VideoFrame frame;
    frame.info.sequence = static_cast<std::uint64_t>(n);
    frame.info.acquired = frame.info.arrived = {1'000'000'000 + 40'000'000 * n};
    frame.width_px = 64;
    frame.height_px = 48;
    frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(3 * 64 * 48, std::uint8_t{20});
    frame.info.pose.kind = PoseKind::interpolated;
    frame.info.pose.tracker_from_sensor =
        Transform<Tracker, Sensor>(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, 0, -80));
    ASSERT_TRUE((*writer)->add(frame));
  }
  ASSERT_TRUE((*writer)->finish("done"));
}

wire::Calibration record_of(int width_px, const calibration::Identity& camera) {
  wire::Calibration out;
  out.in_force = true;
  out.record = testing::signed_record_text(testing::straight_scope_record(width_px, 48, kBird, camera));
  return out;
}

/// What becomes of a replay: its frames.csv's reasons, and the figures.
struct Replayed {
  nlohmann::json figures;
  std::vector<std::string> reasons;  ///< of frames, in order; empty: with an overlay
  std::string output;
};

Replayed replay(const Scratch& scratch, const std::string& recording, const std::string& arguments) {
  const std::string ct = fs::exists(scratch / "ct") ? (scratch / "ct").string() : small_ct(scratch);
  const auto result = run("birdseye", "replay " + (scratch / recording).string() + " --volume " + ct + " --out " +
                                          (scratch / "o").string() + " " + arguments);
  Replayed out;
  out.output = result.output;
  EXPECT_TRUE(result.code == 0 || result.code == 3) << result.output;
  if (result.code != 0 && result.code != 3) return out;
  out.figures = read_json(scratch / "o/replay.json");
  std::istringstream table(contents_of(scratch / "o/frames.csv"));
  std::string line;
  std::getline(table, line);
  while (std::getline(table, line)) {
    std::istringstream row(line);
    std::string cell;
    for (int i = 0; i < 5; ++i) std::getline(row, cell, ',');
    out.reasons.push_back(cell);
  }
  EXPECT_EQ(out.reasons.size(), 8U);
  return out;
}

TEST(ReplayCommand, ARecordOfAnotherInstrumentDrawsNothing) {
  const Scratch scratch;
  record_told(scratch / "r", {{0, {health_of(kBird, kHead)}}});
  // Plain pictures show no motion.
  const std::string registration =
      "--no-motion-check --registration " + scratch.file("reg.txt", kIdentityPose) + " --calibration ";
  const auto by = [&](const calibration::Identity& tracker, const calibration::Identity& camera) {
    return replay(scratch, "r",
                  registration + scratch.file("record.json", testing::signed_record_text(testing::straight_scope_record(
                                                                 64, 48, tracker, camera))));
  };
  const Replayed own = by(kBird, kHead);
  EXPECT_EQ(own.figures["frames_overlaid"], 8) << own.output;
  EXPECT_EQ(own.output.find("nothing tells whether"), std::string::npos) << own.output;
  // A registration's file says nothing of its errors.
  EXPECT_EQ(own.figures["verdict"], "marginal") << own.output;
  EXPECT_NE(own.output.find("nothing states fre_mm: how far the overlay may be off is not known"), std::string::npos);
  EXPECT_FALSE(own.figures.contains("fre_mm")) << own.figures;
  const Replayed other_camera = by(kBird, kOtherHead);
  EXPECT_EQ(other_camera.figures["frames_overlaid"], 0);
  EXPECT_EQ(other_camera.figures["verdict"], "fail");
  EXPECT_EQ(other_camera.reasons[3], "the calibration record is of camera serial B2; this one's is A1");
  EXPECT_NE(other_camera.output.find("give the record of these instruments (--calibration)"), std::string::npos)
      << other_camera.output;
  EXPECT_EQ(by(kOtherBird, kHead).reasons[0],
            "the calibration record is of tracker unit_serial 4712; this one's is 4711");
  // Of a record that says nothing, nothing is known.
  const Replayed unknown = by({}, kHead);
  EXPECT_EQ(unknown.figures["frames_overlaid"], 8);
  EXPECT_EQ(unknown.figures["verdict"], "marginal");
  EXPECT_NE(unknown.output.find("nothing tells whether the calibration record is of the recording's tracker"),
            std::string::npos)
      << unknown.output;
}

TEST(ReplayCommand, WhatNobodyKnownSignedIsUsedOnlyWhenAskedToAndTheVerdictSaysSo) {
  const Scratch scratch;
  record_told(scratch / "r", {{0, {health_of(kBird, kHead)}}});
  const auto record = testing::straight_scope_record(64, 48, kBird, kHead);
  const ThisMachine other = ThisMachine::for_once();
  const std::string by =
      "--no-motion-check --registration " + scratch.file("reg.txt", kIdentityPose) + " --calibration ";
  const std::string ct = small_ct(scratch), out = (scratch / "none").string();
  for (const auto& [text, why] : {std::pair{calibration::record_text(record), "not signed"},
                                  {host::record_text(record, other), "not known here"}}) {
    const std::string file = scratch.file("record.json", text);
    expect_refused("birdseye",
                   "replay " + (scratch / "r").string() + " --volume " + ct + " --out " + out + " " + by + file,
                   {"record.json: the calibration record is", why, "--accept-unsigned"}, out);
    const Replayed asked = replay(scratch, "r", by + file + " --accept-unsigned");
    EXPECT_EQ(asked.figures["frames_overlaid"], 8) << asked.output;
    EXPECT_EQ(asked.figures["verdict"], "marginal") << asked.output;
    EXPECT_NE(asked.output.find("UNSIGNED: the calibration record is"), std::string::npos) << asked.output;
  }
  const std::string good = by + scratch.file("record.json", host::record_text(record, *testing::authors().machine));
  EXPECT_EQ(replay(scratch, "r", good).output.find("UNSIGNED"), std::string::npos);
  const std::string more = scratch.file("r/more.txt", "not of the recording");
  const std::string again = "replay " + (scratch / "r").string() + " --volume " + ct + " --out " + out + " " + good;
  expect_refused("birdseye", again, {"was added since the recording was signed: more.txt"}, out);
  std::filesystem::remove(more);
  std::string sheet = contents_of(scratch / "r/recording.json");
  (void)scratch.file("r/recording.json", sheet.replace(sheet.find("done"), 4, "DONE"));
  expect_refused("birdseye", again, {"/r: its signature", "does not fit"}, out);
}

TEST(ReplayCommand, DrawsOverNoPictureOfAnotherSession) {
  const Scratch scratch;
  record(scratch / "r");
  const std::string command = inputs(scratch, small_ct(scratch)) + " --registration " +
                              scratch.file("reg.txt", kIdentityPose) + " --accept-unsigned --out ";
  // Nobody signed it, so that the frames themselves have to tell.
  nlohmann::json sheet = read_json(scratch / "r/recording.json");
  sheet.erase("signed");
  sheet.erase("sha256");
  (void)scratch.file("r/recording.json", sheet.dump());
  const auto good = run("birdseye", command + (scratch / "good").string());
  EXPECT_EQ(good.code, 0) << good.output;
  std::string video = contents_of(scratch / "r/video.igs.mha");
  const std::string number = "Seq_Frame0000_FrameNumber = 7\n";
  ASSERT_NE(video.find(number), std::string::npos);
  (void)scratch.file("r/video.igs.mha", video.replace(video.find(number) + number.size() - 2, 1, "9"));
  expect_refused("birdseye", command + (scratch / "o").string(), {"the pictures of video are not those of its events"});
  EXPECT_TRUE(fs::exists(scratch / "good/overlay-000007.png"));
  EXPECT_FALSE(fs::exists(scratch / "o/overlay-000007.png"));
}

TEST(ReplayCommand, FramesAfterTheCameraWasExchangedBearNoOverlay) {
  const Scratch scratch;
  wire::Calibration withdrawn;
  withdrawn.why_not = "the record is of camera serial A1, this one's is B2";
  const std::string registration = "--registration " + scratch.file("reg.txt", kIdentityPose);
  record_told(scratch / "exchanged", {{0, {health_of(kBird, kHead), record_of(64, kHead)}},
                                      {3, {health_of(kBird, kOtherHead)}},
                                      {6, {health_of(kBird, kHead)}}});
  const Replayed exchanged = replay(scratch, "exchanged", registration);
  EXPECT_EQ(exchanged.figures["frames_of_other_hardware"], 3) << exchanged.output;
  EXPECT_EQ(exchanged.figures["verdict"], "fail");
  EXPECT_EQ(exchanged.reasons[2], "");
  EXPECT_NE(exchanged.reasons[3].find("serial A1"), std::string::npos) << exchanged.reasons[3];
  EXPECT_EQ(exchanged.figures["frames_overlaid"].get<int>(), 5) << "and the rest does";
  record_told(scratch / "withdrawn", {{0, {health_of(kBird, kHead), record_of(64, kHead)}}, {5, {withdrawn}}});
  const Replayed held_back = replay(scratch, "withdrawn", registration);
  EXPECT_EQ(held_back.figures["frames_overlaid"], 5) << held_back.output;
  EXPECT_NE(held_back.reasons[5].find("the appliance withdrew its calibration record"), std::string::npos);
  // By a person's own files nobody asks.
  const Replayed own = replay(scratch, "exchanged",
                              registration + " --camera " + scratch.file("camera.yaml", kReplayCamera) +
                                  " --camera-from-sensor " + scratch.file("hand_eye.txt", kIdentityPose));
  EXPECT_EQ(own.figures["frames_overlaid"], 8) << own.output;
}

TEST(ReplayCommand, FramesOfAnotherSizeBearNoOverlay) {
  const Scratch scratch;
  record_told(scratch / "r", {{0, {health_of(kBird, kHead), record_of(128, kHead)}}});
  const Replayed done = replay(scratch, "r", "--registration " + scratch.file("reg.txt", kIdentityPose));
  EXPECT_EQ(done.figures["frames_overlaid"], 0);
  EXPECT_EQ(done.figures["verdict"], "fail");
  EXPECT_EQ(done.reasons[0], "the video is 64 x 48 and the camera was calibrated at 128 x 48");
  EXPECT_NE(done.output.find("8 of 8 frames are of another size"), std::string::npos) << done.output;
}

TEST(ReplayCommand, TakesWhatAWindowKeptForItsOwnCtAndInstruments) {
  const Scratch scratch;
  record_told(scratch / "r", {{0, {health_of(kBird, kHead)}}, {6, {health_of(kOtherBird, kHead)}}});
  const std::string ct = small_ct(scratch);
  host::Operation kept;
  kept.ct_sha256 = host::ct_sha256(*host::import_volume(ct));
  kept.made_utc = "2026-11-22T10:00:00Z";
  kept.calibrated = {*host::ScopeSetup::of_record(testing::straight_scope_record(64, 48, kBird, kHead)),
                     "2026-11-22T09:30:00Z",
                     true,
                     {kBird, kHead, 0}};
  kept.registered = {{}, 0.3, {{0, 0, 0}, {30, 0, 0}, {0, 50, 0}, {10, 0, 70}}, {kBird, {}, 0}};
  ASSERT_TRUE(host::write_operation(scratch.path(), kept, *testing::authors().machine));
  const std::string arguments = "--operation " + scratch.path().string();
  const Replayed done = replay(scratch, "r", arguments);
  EXPECT_EQ(done.figures["frames_overlaid"], 6) << done.output;
  EXPECT_EQ(done.reasons[6], "the operation's calibration is of tracker unit_serial 4711; this one's is 4712");
  EXPECT_EQ(done.figures["fre_mm"], 0.3);
  // The copies beside it are nobody's word; one taken for itself says of which CT it is.
  const std::string copy = scratch.file("copy.txt", contents_of(scratch / "patient_from_tracker.txt"));
  const std::string pictures = done.figures["pictures_crc32"];
  (void)scratch.file("patient_from_tracker.txt", "1 0 0 20\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  EXPECT_EQ(replay(scratch, "r", arguments).figures["pictures_crc32"], pictures);
  const auto refused = [&](const std::string& command, const std::vector<std::string>& words) {
    expect_refused("birdseye", command, words, scratch / "none");
  };
  const std::string by_operation = " --volume " + ct + " --operation " + scratch.path().string();
  refused("replay " + (scratch / "r").string() + by_operation + " --registration " +
              scratch.file("reg.txt", kIdentityPose) + " --out " + (scratch / "none").string(),
          {"--operation", "excludes", "--registration"});
  // Another CT in its place, and a folder whose operation somebody edited.
  fs::remove_all(scratch / "ct");
  small_ct(scratch, 11);
  refused("replay " + (scratch / "r").string() + by_operation + " --out " + (scratch / "none").string(),
          {"--operation", "is of another CT"});
  refused("export" + by_operation + " --out " + (scratch / "none").string(), {"--operation", "is of another CT"});
  refused("export --volume " + ct + " --registration " + copy + " --out " + (scratch / "none").string(),
          {"copy.txt: is of another CT"});
  refused("render" + by_operation + " --pose " + scratch.file("pose.txt", kIdentityPose) + " --out " +
              (scratch / "none").string() + ".png",
          {"--operation", "is of another CT"});
  std::string edited = contents_of(scratch / "operation.json");
  edited.replace(edited.find("\"fre_mm\":0.3"), 12, "\"fre_mm\":0.1");
  (void)scratch.file("operation.json", edited);
  refused("export" + by_operation + " --out " + (scratch / "none").string(), {"\"registered\" was changed"});
}

TEST(ReplayCommand, ExportAndRenderTakeWhatAWindowKept) {
  const Scratch scratch;
  const std::string ct = small_ct(scratch);
  host::Operation kept;
  kept.ct_sha256 = host::ct_sha256(*host::import_volume(ct));
  kept.calibrated = {*host::ScopeSetup::of_record(testing::straight_scope_record(64, 48, kBird, kHead)),
                     "2026-11-22T09:30:00Z", true};
  kept.registered = {
      Transform<Tracker, Patient>(Eigen::Matrix3d::Identity(), {100, 0, 0}), 0.3, {{0, 0, 0}, {30, 0, 0}, {0, 50, 0}}};
  fs::create_directories(scratch / "kept");
  ASSERT_TRUE(host::write_operation(scratch / "kept", kept, *testing::authors().machine));
  const std::string by_operation = " --volume " + ct + " --operation " + (scratch / "kept/operation.json").string();
  const auto exported = run("birdseye", "export" + by_operation + " --out " + (scratch / "slicer").string());
  ASSERT_EQ(exported.code, 0) << exported.output;
  const auto seen = host::import_volume(scratch / "slicer/ct.nrrd");
  ASSERT_TRUE(seen) << seen.error().what;
  EXPECT_NEAR((seen->patient_from_voxel.translation() - host::import_volume(ct)->patient_from_voxel.translation()).x(),
              100, 1e-3);
  const auto rendered =
      run("birdseye", "render" + by_operation + " --transfer abdomen --pose " +
                          scratch.file("pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1 80\n0 0 0 1\n") + " --json " +
                          (scratch / "render.json").string() + " --out " + (scratch / "picture.png").string());
  ASSERT_EQ(rendered.code, 0) << rendered.output;
  EXPECT_EQ(read_json(scratch / "render.json")["width_px"], 64);
}

TEST(ReplayCommand, RenderAsksASnapshotWhatItWasTakenWith) {
  const Scratch scratch;
  const std::string ct = small_ct(scratch);
  host::Operation kept;
  kept.ct_sha256 = host::ct_sha256(*host::import_volume(ct));
  kept.calibrated = {*host::ScopeSetup::of_record(testing::straight_scope_record(64, 48, kBird, kHead)),
                     "2026-11-22T09:30:00Z",
                     false,
                     {kBird, kHead, 0},
                     "no. 17"};
  fs::create_directories(scratch / "kept");
  ASSERT_TRUE(host::write_operation(scratch / "kept", kept, *testing::authors().machine));
  host::Snapshot snapshot;
  snapshot.frame.width_px = snapshot.shown.width_px = 64;
  snapshot.frame.height_px = snapshot.shown.height_px = 48;
  snapshot.picture.assign(3 * 64 * 48, 90);
  snapshot.frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(snapshot.picture);
  const fs::path out = scratch / "out.png";
  const std::string command = "render --volume " + ct + " --operation " + (scratch / "kept").string() + " --pose " +
                              scratch.file("pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1 80\n0 0 0 1\n") + " --over " +
                              (scratch / "shot/video.png").string() + " --out " + out.string();
  const auto taken_with = [&](const host::PictureHardware& told) {
    snapshot.taken_with = told;
    ASSERT_TRUE(host::write_snapshot(scratch / "shot", snapshot));
  };
  const std::string remedy = "give the operation that was done with what took this picture";
  taken_with({kBird, kOtherHead, "no. 17"});
  expect_refused("birdseye", command, {"video.png", "is of camera serial A1; this one's is B2", remedy}, out);
  taken_with({kOtherBird, kHead, "no. 17"});
  expect_refused("birdseye", command, {"is of tracker unit_serial 4711; this one's is 4712", remedy}, out);
  taken_with({kBird, kHead, "no. 18"});
  expect_refused("birdseye", command, {"is of scope name no. 17; this one's is no. 18", remedy}, out);
  const std::string unproven = "nothing tells whether";
  taken_with({kBird, kHead, "no. 17"});
  const auto same = run("birdseye", command);
  ASSERT_EQ(same.code, 0) << same.output;
  EXPECT_EQ(same.output.find(unproven), std::string::npos) << same.output;
  taken_with({kBird, {}, "no. 17"});
  const auto untold = run("birdseye", command);
  ASSERT_EQ(untold.code, 0) << untold.output;
  EXPECT_NE(untold.output.find(unproven), std::string::npos) << untold.output;
}

}  // namespace
}  // namespace birdseye
