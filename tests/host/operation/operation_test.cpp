// What a window keeps of an operation, and what is refused of it: not one bit may be other than it was.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string_view>

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "drivers/system/wait.hpp"
#include "host/files/packed_floats.hpp"
#include "host/files/sealed_text.hpp"
#include "host/operation/calibration_step.hpp"
#include "host/operation/operation_keeper.hpp"
#include "tests/support/live_operation.hpp"
#include "tests/support/this_machine.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::contents_of;
using birdseye::testing::kCamera;
using birdseye::testing::kFiducials;
using birdseye::testing::kTracker;
using birdseye::testing::kTrackerFromPatient;
using birdseye::testing::Scratch;

/// With all that there can be in one.
Operation whole_operation() {
  Operation out;
  out.ct_sha256 = "1";
  out.labels_sha256 = "2";
  out.record_sha256 = "3";
  out.made_utc = "2026-11-22T10:00:00Z";
  calibration::HandEyeResult found;
  found.camera_from_sensor = Transform<Camera, Sensor>(kTrackerFromPatient.rotation(), {1.0 / 3, -120, 250});
  found.held_out_px = 3;
  found.held_out_mm = 0.6;
  found.independent_stations = 17;
  const CameraMatrix covariance = CameraMatrix::Identity() / 7;
  out.calibrated = {
      ScopeSetup::of_hand_eye({768, 576, 500.1, 500, 384, 288, -0.1, 0.2, 1e-4, -1e-5, 0.3}, 0.3, found, covariance)
          .with_round_field(RoundField{{383.5, 1.0 / 3}, 280}),
      "2026-11-22T09:35:00Z",
      true,
      {kTracker, kCamera, 0},
      "no. 17"};
  out.registered = {kTrackerFromPatient, 0.3, kFiducials, {kTracker, {}, 0}, "2026-11-22T09:50:00Z"};
  DisplacementField field;
  field.size = {3, 2, 2};
  for (int i = 0; i < 12; ++i) field.displacement_mm.emplace_back(0.1F * static_cast<float>(i % 5), -1.0F / 3, 0.0F);
  field.patient_from_lattice = Eigen::Translation3d(-50, -50, -50) * Eigen::Scaling(100.0);
  out.deformed = std::make_shared<const DeformedOrgan>(
      DeformedOrgan{field, 0.7, MotionError{0.7, 1.2}, "2026-11-22T09:55:00Z", Eigen::Vector3d{1, 2, 3}, "few views"});
  return out;
}

TEST(Operation, IsReadBackToTheBit) {
  const Scratch scratch;
  const Operation kept = whole_operation();
  ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
  const auto read = read_operation(scratch.path());
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->record_sha256, "3");
  EXPECT_EQ(read->made_utc, kept.made_utc);
  EXPECT_EQ(read->calibrated->scope.camera(), kept.calibrated->scope.camera());
  EXPECT_EQ(read->calibrated->scope.camera_from_sensor().matrix(),
            kept.calibrated->scope.camera_from_sensor().matrix());
  EXPECT_EQ(*read->calibrated->scope.camera_covariance(), *kept.calibrated->scope.camera_covariance());
  EXPECT_EQ(read->calibrated->scope.round_field(), kept.calibrated->scope.round_field());
  EXPECT_EQ(read->calibrated->scope.figures().held_out_px, 3);
  EXPECT_EQ(read->calibrated->scope.figures().held_out_mm, 0.6);
  EXPECT_EQ(read->calibrated->scope.figures().hand_eye_stations, 17);
  EXPECT_TRUE(read->calibrated->by_board);
  EXPECT_EQ(read->calibrated->found_with.camera, kCamera);
  EXPECT_EQ(read->calibrated->scope_name, "no. 17");
  EXPECT_EQ(read->registered->tracker_from_patient.matrix(), kTrackerFromPatient.matrix());
  EXPECT_EQ(read->registered->found_with.tracker, kTracker);
  EXPECT_EQ(read->registered->made_utc, "2026-11-22T09:50:00Z");
  EXPECT_EQ(read->registered->fiducials_in_patient_mm, kFiducials);
  EXPECT_EQ(read->deformed->field.displacement_mm, kept.deformed->field.displacement_mm);
  EXPECT_EQ(read->deformed->field.patient_from_lattice.matrix(), kept.deformed->field.patient_from_lattice.matrix());
  EXPECT_EQ(read->deformed->target->radius95_mm, 1.2);
  EXPECT_EQ(read->deformed->care, "few views");
  EXPECT_TRUE(read_operation(scratch / "operation.json")) << "the file itself is named as well as its folder";
}

TEST(Operation, KeepsWhatSpeaksAgainstARegistrationAndADeformation) {
  const Scratch scratch;
  Operation kept = whole_operation();
  kept.registered->doubt = "mirrored or not cannot be told";
  kept.registered->off = {{{1, 2, 3}, "tumour", 7.5, true, true}};
  kept.calibrated->in_place_of_utc = "2026-11-22T08:00:00Z";
  ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
  const auto read = read_operation(scratch.path());
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->registered->doubt, kept.registered->doubt);
  ASSERT_EQ(read->registered->off.size(), 1U);
  EXPECT_EQ(read->registered->off[0].in_ct_mm, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(read->registered->off[0].name, "tumour");
  EXPECT_EQ(read->registered->off[0].off_mm, 7.5);
  EXPECT_TRUE(read->registered->off[0].deformed && read->registered->off[0].refuses);
  EXPECT_EQ(read->calibrated->in_place_of_utc, kept.calibrated->in_place_of_utc);
  EXPECT_EQ(read->deformed->target_at_rest_mm, Eigen::Vector3d(1, 2, 3));
  EXPECT_TRUE(check_target(*read, {1, 2, 3.4}));
  const auto other = check_target(*read, {80, 80, 80});
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().what.find("1.0 2.0 3.0"), std::string::npos) << other.error().what;
}

TEST(Operation, KeepsLandmarksThatWerePickedAndTheTipThatTouched) {
  const Scratch scratch;
  Operation kept = whole_operation();
  kept.landmarks = {{"landmark 1", {1, -2, 1.0 / 3}}, {"landmark 2", {40, 50, 60}}};
  kept.registered->tip_in_pointer_mm = Eigen::Vector3d(0, 1.0 / 3, 150);
  ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
  const auto read = read_operation(scratch.path());
  ASSERT_TRUE(read) << read.error().what;
  ASSERT_EQ(read->landmarks.size(), 2U);
  EXPECT_EQ(read->landmarks[0].name, "landmark 1");
  EXPECT_EQ(read->landmarks[0].place_mm, Eigen::Vector3d(1, -2, 1.0 / 3));
  EXPECT_EQ(read->landmarks[1].place_mm, Eigen::Vector3d(40, 50, 60));
  EXPECT_EQ(read->registered->tip_in_pointer_mm, Eigen::Vector3d(0, 1.0 / 3, 150));
  kept.landmarks[1].place_mm.x() = 1e9;
  ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
  const auto refused = read_operation(scratch.path());
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("landmarks: has a landmark farther than"), std::string::npos)
      << refused.error().what;
}

/// At which angle a rod was an operation does not keep, and nothing is drawn by another.
TEST(Operation, OfAScopeWithARodTheAngleIsMissing) {
  const Scratch scratch;
  Operation kept = whole_operation();
  kept.calibrated = testing::calibrated_by(testing::example_record(768, 576, kTracker, kCamera));
  ASSERT_TRUE(kept.calibrated->scope.has_rod());
  ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
  const auto read = read_operation(scratch.path());
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_TRUE(read->calibrated->scope.figures().rod_angle_missing);
  ASSERT_TRUE(write_operation(scratch.path(), *read, *testing::authors().machine));
  EXPECT_TRUE(read_operation(scratch.path())->calibrated->scope.figures().rod_angle_missing) << "written again";
}

/// The names of the part that a place of the text lies in; of a comma or an end of line, of the two about it.
std::vector<std::string> parts_at(const std::string& text, std::size_t at) {
  std::vector<std::string> out;
  for (const std::size_t place : {at, std::min(at + 2, text.size() - 1)}) {
    const std::size_t line = text.rfind('\n', place == 0 ? 0 : place - 1);
    const std::size_t name = line == std::string::npos ? 0 : line + 2;
    out.push_back(text.substr(name, text.find('"', name) - name));
  }
  return out;
}

TEST(Operation, OneBitThatIsChangedAnywhereIsRefusedWithTheNameOfItsPart) {
  const Scratch scratch;
  ASSERT_TRUE(write_operation(scratch.path(), whole_operation(), *testing::authors().machine));
  const std::string text = contents_of(scratch / "operation.json");
  const std::size_t sums = text.find("\n\"sha256\"");
  ASSERT_NE(sums, std::string::npos);
  for (std::size_t at = 0; at < text.size(); ++at) {
    std::string changed = text;
    changed[at] = static_cast<char>(changed[at] ^ (1 << (at % 8)));
    const auto read = read_operation(scratch.file("changed.json", changed));
    ASSERT_FALSE(read) << "byte " << at << " of " << text.size() << " was changed and nobody noticed";
    const std::string& why = read.error().what;
    EXPECT_NE(why.find("changed.json"), std::string::npos) << why;
    if (at < 3 || at > sums) continue;  // no part, or its sum
    const auto names = parts_at(text, at);
    EXPECT_TRUE(
        std::any_of(names.begin(), names.end(),
                    [&why](const std::string& name) { return why.find("\"" + name + "\"") != std::string::npos; }))
        << "byte " << at << ", in " << names.front() << ": " << why;
  }
}

TEST(Operation, AHalfWrittenFileIsRefusedWithTheNameOfThePartItEndsIn) {
  const Scratch scratch;
  ASSERT_TRUE(write_operation(scratch.path(), whole_operation(), *testing::authors().machine));
  const std::string text = contents_of(scratch / "operation.json");
  for (std::size_t length = 0; length < text.size(); ++length)
    ASSERT_FALSE(read_operation(scratch.file("cut.json", text.substr(0, length)))) << length;
  const auto cut = read_operation(scratch.file("cut.json", text.substr(0, text.find("\"fre_mm\""))));
  EXPECT_NE(cut.error().what.find("cut off in its part \"registered\""), std::string::npos) << cut.error().what;
  // A part that is whole, of another operation, does not fit the rest.
  Operation other = whole_operation();
  other.registered->fre_mm = 0.1;
  ASSERT_TRUE(write_operation(scratch.path(), other, *testing::authors().machine));
  const std::string others = contents_of(scratch / "operation.json");
  const auto part = [](const std::string& from) {
    const std::size_t at = from.find("\n\"registered\"");
    return from.substr(at, from.find('\n', at + 1) - at);
  };
  std::string mixed = text;
  mixed.replace(mixed.find(part(text)), part(text).size(), part(others));
  const auto read = read_operation(scratch.file("mixed.json", mixed));
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().what.find("\"registered\" was changed"), std::string::npos) << read.error().what;
}

TEST(Operation, TheCopiesBesideItAreForOthersAndAreNotRead) {
  const Scratch scratch;
  ASSERT_TRUE(write_operation(scratch.path(), whole_operation(), *testing::authors().machine));
  for (const char* const copy : {"patient_from_tracker.txt", "camera_from_sensor.txt", "camera.yaml", "field.mha"}) {
    ASSERT_TRUE(std::filesystem::exists(scratch / copy)) << copy;
    (void)scratch.file(copy, "1 0 0 20\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  }
  const auto read = read_operation(scratch.path());
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->registered->tracker_from_patient.matrix(), kTrackerFromPatient.matrix());
  // What is taken back is taken away there too.
  Operation less = whole_operation();
  less.calibrated.reset();
  less.registered.reset();
  less.deformed.reset();
  ASSERT_TRUE(write_operation(scratch.path(), less, *testing::authors().machine));
  for (const char* const copy : {"patient_from_tracker.txt", "camera_from_sensor.txt", "camera.yaml", "field.mha"})
    EXPECT_FALSE(std::filesystem::exists(scratch / copy)) << copy;
}

TEST(Operation, FilesOfTheUsersOwnByTheNamesOfCopiesAreLeftAlone) {
  Operation bare = whole_operation();
  bare.calibrated.reset();
  bare.registered.reset();
  bare.deformed.reset();
  for (const char* const name : {"patient_from_tracker.txt", "camera_from_sensor.txt", "camera.yaml", "field.mha"}) {
    const Scratch scratch;
    const std::string own = scratch.file(name, "the user's own");
    const auto refused = write_operation(scratch.path(), whole_operation(), *testing::authors().machine);
    ASSERT_FALSE(refused) << name;
    EXPECT_NE(refused.error().what.find(std::string(name) + ": is there"), std::string::npos) << refused.error().what;
    EXPECT_FALSE(has_operation(scratch.path())) << "a later write would take the file for its own";
    for (int n = 0; n < 2; ++n) ASSERT_TRUE(write_operation(scratch.path(), bare, *testing::authors().machine));
    EXPECT_FALSE(write_operation(scratch.path(), whole_operation(), *testing::authors().machine)) << name;
    EXPECT_EQ(contents_of(own), "the user's own");
  }
}

/// Where the power goes, there is a temporary file that was begun, and the former operation.
TEST(Operation, WhatAPowerCutLeavesIsTheFormerOperation) {
  const Scratch scratch;
  ASSERT_TRUE(write_operation(scratch.path(), whole_operation(), *testing::authors().machine));
  const std::string text = contents_of(scratch / "operation.json");
  for (const std::size_t length : {std::size_t{0}, text.size() / 2, text.size()}) {
    (void)scratch.file("operation.json.part", text.substr(0, length));
    std::filesystem::create_directories(scratch / "part-a1B2c3");
    (void)scratch.file("part-a1B2c3/field.mha", "ObjectType");
    const auto read = read_operation(scratch.path());
    ASSERT_TRUE(read) << read.error().what;
    Operation next = whole_operation();
    next.registered->fre_mm = 0.2;
    ASSERT_TRUE(write_operation(scratch.path(), next, *testing::authors().machine));
    EXPECT_EQ(read_operation(scratch.path())->registered->fre_mm, 0.2);
  }
}

/// What a keeper whose operation cannot be taken up writes of another.
TEST(OperationKeeper, AfterARefusalKeepsWhatIsFoundInAnotherFolderOnly) {
  const Scratch scratch;
  const auto refused = scratch / "refused", fresh = scratch / "fresh";
  for (const auto& folder : {refused, fresh}) std::filesystem::create_directory(folder);
  ASSERT_TRUE(write_operation(refused, whole_operation(), *testing::authors().machine));
  const std::string before = contents_of(refused / "operation.json");
  Operation next = whole_operation();
  next.ct_sha256 = "another";
  const auto keep_in = [&](const std::filesystem::path& out) {
    OperationKeeper keeper(out, refused, testing::authors());
    const auto taken = keeper.take_up("another", "2", {});
    EXPECT_FALSE(taken);
    keeper.keep(next);
    return taken ? std::string() : taken.error().what;  // the keeper's end waits until all is written
  };
  EXPECT_NE(keep_in(refused).find("is not kept"), std::string::npos);
  EXPECT_EQ(contents_of(refused / "operation.json"), before);
  EXPECT_EQ(keep_in(fresh).find("is not kept"), std::string::npos);
  EXPECT_EQ(contents_of(refused / "operation.json"), before);
  const auto kept = read_operation(fresh);
  ASSERT_TRUE(kept) << kept.error().what;
  EXPECT_EQ(kept->ct_sha256, "another");
}

TEST(Operation, AFileOf010OrOfALaterVersionIsRefusedInWords) {
  const Scratch scratch;
  (void)scratch.file("operation.json", R"({
  "calibrated": {"camera_rms_px": 0.3, "hand_eye_mm": 0.6, "made_utc": "2026-11-22T09:35:00Z", "tracked_rms_px": 1.2},
  "ct_checksum": "1234567890abcdef",
  "deformed": false,
  "made_utc": "2026-11-22T10:00:00Z"
})");
  const auto old = read_operation(scratch.path());
  ASSERT_FALSE(old);
  EXPECT_NE(old.error().what.find("version 0.1.0"), std::string::npos) << old.error().what;
  EXPECT_NE(old.error().what.find("register anew"), std::string::npos) << old.error().what;
  const auto later = read_operation(
      scratch.file("later.json", sealed_text({{"format", {{"name", "birdseye operation"}, {"version", 3}}}})));
  ASSERT_FALSE(later);
  EXPECT_NE(later.error().what.find("is of version 3"), std::string::npos) << later.error().what;
  const auto other =
      read_operation(scratch.file("other.json", sealed_text({{"format", {{"name", "something"}, {"version", 2}}}})));
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().what.find("is no operation"), std::string::npos) << other.error().what;
}

TEST(Operation, ALatticeOfAnotherSizeThanItsNumbersIsRefused) {
  const Scratch scratch;
  ASSERT_TRUE(write_operation(scratch.path(), whole_operation(), *testing::authors().machine));
  const nlohmann::json sheet = *unseal(contents_of(scratch / "operation.json"));
  // Of the first the product of the three is 0 in 64 bits; the second takes 48 GB.
  for (const std::array<int, 3>& size : {std::array{1 << 22, 1 << 21, 1 << 21}, {2000, 2000, 1000}, {3, 2, 1}}) {
    nlohmann::json deformed = sheet.at("deformed");
    deformed["size"] = size;
    if (size[0] > 2000) deformed["displacement_mm_float32_zlib_base64"] = packed_floats({});
    const auto read = read_operation(scratch.file("other.json", sealed_text({{"format", sheet.at("format")},
                                                                             {"made", sheet.at("made")},
                                                                             {"ct", sheet.at("ct")},
                                                                             {"deformed", deformed}})));
    ASSERT_FALSE(read);
    EXPECT_NE(read.error().what.find("is no size of a lattice"), std::string::npos) << read.error().what;
  }
}

/// Whoever signed it: with a negative error the circle would be too small.
TEST(Operation, FiguresThatNobodyCanHaveMeasuredAreRefusedByTheirName) {
  const Scratch scratch;
  ASSERT_TRUE(write_operation(scratch.path(), whole_operation(), *testing::authors().machine));
  const nlohmann::json sheet = *unseal(contents_of(scratch / "operation.json"));
  const auto refusal = [&](const char* part, const char* figure, const nlohmann::json& value) {
    nlohmann::json changed = sheet;
    changed.at(part)[nlohmann::json::json_pointer(figure)] = value;
    std::vector<SealedPart> parts;
    for (const auto& [name, of_part] : changed.items()) parts.emplace_back(name, of_part);
    const auto read = read_operation(scratch.file("other.json", sealed_text(parts)));
    return read ? std::string("is taken up") : read.error().what;
  };
  const auto square = [](int side, double value) {
    return nlohmann::json(std::vector<std::vector<double>>(static_cast<std::size_t>(side),
                                                           std::vector<double>(static_cast<std::size_t>(side), value)));
  };
  nlohmann::json correlated = square(6, 0), lopsided = square(6, 0), without_variance = square(6, -1e6);
  for (std::size_t i = 0; i < 6; ++i) {
    correlated[i][i] = lopsided[i][i] = 1;
    without_variance[i][i] = 0;
  }
  correlated[0][1] = correlated[1][0] = 2;
  lopsided[0][1] = 0.5;
  nlohmann::json points = sheet.at("registered").at("fiducials_in_patient_mm");
  for (nlohmann::json& point : points) point = {1, 2, 3};
  const std::int64_t wraps = (std::int64_t{1} << 32) + 512;
  for (const auto& [part, figure, value, told] :
       {std::tuple<const char*, const char*, nlohmann::json, const char*>{"calibrated", "/held_out_mm", -1,
                                                                          "held_out_mm is -1"},
        {"calibrated", "/camera_rms_px", 1e300, "camera_rms_px"},
        {"calibrated", "/hand_eye_stations", -5, "hand_eye_stations"},
        {"calibrated", "/hand_eye_stations", 1e30, "is missing, or is not of the kind"},
        {"calibrated", "/lens/width_px", wraps, "is missing, or is not of the kind"},
        {"calibrated", "/lens/covariance", square(9, -1), "the lens's covariance is no covariance"},
        {"calibrated", "/lens/covariance", square(9, 1e308), "the lens's covariance is no covariance"},
        {"calibrated", "/hand_eye_covariance", square(6, -1), "hand_eye_covariance is no covariance"},
        {"calibrated", "/hand_eye_covariance", correlated, "hand_eye_covariance is no covariance"},
        {"calibrated", "/hand_eye_covariance", lopsided, "hand_eye_covariance is no covariance"},
        {"calibrated", "/hand_eye_covariance", without_variance, "hand_eye_covariance is no covariance"},
        {"registered", "/fre_mm", -1, "fre_mm is -1"},
        {"registered", "/fiducials_in_patient_mm", points, "at one place"},
        {"registered", "/fiducials_in_patient_mm/0/0", 1e300, "m away"},
        {"deformed", "/seen_rms_mm", -5, "seen_rms_mm is -5"},
        {"deformed", "/target/radius95_mm", 0.001, "do not go together"},
        {"deformed", "/target/radius95_mm", -1, "radius95_mm is -1"}}) {
    const std::string said = refusal(part, figure, value);
    EXPECT_NE(said.find(told), std::string::npos) << part << figure << ": " << said;
    EXPECT_NE(said.find("register anew"), std::string::npos) << said;
  }
  EXPECT_EQ(refusal("registered", "/fre_mm", 0.31), "is taken up") << "else nothing above is told";
}

TEST(Operation, APartThatStandsTwiceIsRefused) {
  const Scratch scratch;
  const nlohmann::json part{{"a", 1}};
  ASSERT_TRUE(unseal(sealed_text({{"one", part}, {"two", part}})));
  EXPECT_FALSE(unseal(sealed_text({{"one", part}, {"one", part}})));
}

void wait_for(const OperationKeeper& keeper) {
  for (int i = 0; i < 1000 && keeper.writing(); ++i) sleep_for(Duration::from_ms(10));
  ASSERT_FALSE(keeper.writing());
}

TEST(OperationKeeper, KeepsNothingBeforeItHasTakenUpNorOverAnotherCts) {
  const Scratch scratch;
  Operation one;
  one.ct_sha256 = "1";
  one.registered = {kTrackerFromPatient, 0.3, kFiducials};
  OperationKeeper(scratch.path(), {}, testing::authors()).keep(one);
  ASSERT_TRUE(has_operation(scratch.path()));
  Operation other = one;
  other.registered->fre_mm = 7;
  OperationKeeper keeper(scratch.path(), scratch.path(), testing::authors());
  keeper.keep(other);
  const auto kept = keeper.take_up("1", "", {1, 2, 3});
  ASSERT_TRUE(kept) << kept.error().what;
  EXPECT_EQ((*kept)->registered->fre_mm, 0.3);
  EXPECT_FALSE((*keeper.take_up("1", "", {1, 2, 3})).has_value()) << "once";
  keeper.keep(other);
  wait_for(keeper);
  keeper.tick();
  EXPECT_EQ(keeper.fault(), "");
  EXPECT_EQ(read_operation(scratch.path())->registered->fre_mm, 7);
  OperationKeeper wrong(scratch.path(), scratch.path(), testing::authors());
  EXPECT_FALSE(wrong.take_up("2", "", {}));
  wrong.keep(one);
  wait_for(wrong);
  EXPECT_EQ(read_operation(scratch.path())->registered->fre_mm, 7);
}

TEST(OperationKeeper, OfOtherLabelsNothingIsTakenUp) {
  const Scratch scratch;
  OperationKeeper(scratch.path(), {}, testing::authors()).keep(whole_operation());
  EXPECT_TRUE(OperationKeeper({}, scratch.path(), testing::authors()).take_up("1", "2", {1, 2, 3}));
  EXPECT_TRUE(OperationKeeper({}, scratch.path(), testing::authors()).take_up("1", "", {1, 2, 3})) << "none are shown";
  const auto other = OperationKeeper({}, scratch.path(), testing::authors()).take_up("1", "3", {1, 2, 3});
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().what.find("is of other labels"), std::string::npos) << other.error().what;
}

TEST(OperationKeeper, SaysWhatCannotBeKept) {
  const Scratch scratch;
  OperationKeeper keeper(scratch.file("a file", ""), {}, testing::authors());
  keeper.keep(whole_operation());
  wait_for(keeper);
  keeper.keep(whole_operation());
  EXPECT_NE(keeper.fault().find("operation.json"), std::string::npos) << "of the former: " << keeper.fault();
  wait_for(keeper);
  keeper.tick();
  EXPECT_NE(keeper.fault().find("operation.json"), std::string::npos) << keeper.fault();
}

/// A disk that has room again takes what it did not before, and one that has none is told.
TEST(OperationKeeper, AtItsEndWritesOnceMoreWhatCouldNotBeKept) {
  const Scratch scratch;
  const auto folder = scratch / "out";
  (void)scratch.file("out", "");  // a file where the folder should be
  OperationKeeper keeper(folder, {}, testing::authors()), other(folder, {}, testing::authors());
  for (OperationKeeper* const one : {&keeper, &other}) {
    one->keep(whole_operation());
    wait_for(*one);
    one->tick();
    EXPECT_NE(one->fault(), "");
  }
  other.keep(whole_operation());
  other.finish();
  EXPECT_NE(other.fault().find("operation.json"), std::string::npos) << other.fault();
  std::filesystem::remove(folder);
  std::filesystem::create_directory(folder);
  keeper.finish();
  EXPECT_EQ(keeper.fault(), "");
  EXPECT_TRUE(read_operation(folder));
}

TEST(OperationKeeper, WhatWasFoundLastIsKeptBehindAWriteThatRuns) {
  const Scratch scratch;
  Operation last = whole_operation();
  last.registered->fre_mm = 0.2;
  {
    OperationKeeper keeper(scratch.path(), {}, testing::authors());
    for (int i = 0; i < 20; ++i) keeper.keep(whole_operation());
    keeper.keep(last);
    EXPECT_TRUE(keeper.writing());
  }
  const auto read = read_operation(scratch.path());
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ(read->registered->fre_mm, 0.2);
}

/// A figure that is not known is none in the files either.
TEST(OperationKeeper, AFigureThatIsNotKnownStaysUnknown) {
  const Scratch scratch;
  Operation one;
  one.ct_sha256 = "1";
  one.calibrated = {ScopeSetup::of_hand_eye({768, 576, 500, 500, 384, 288}, std::nullopt, {}), "2026-11-22T09:35:00Z",
                    true};
  OperationKeeper(scratch.path(), {}, testing::authors()).keep(one);
  const auto read = read_operation(scratch.path());
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_FALSE(read->calibrated->scope.figures().camera_rms_px.has_value());
  EXPECT_FALSE(read->calibrated->scope.figures().held_out_px.has_value());
  EXPECT_TRUE(read->calibrated->scope.figures().held_out_mm.has_value());
  EXPECT_TRUE(read->calibrated->by_board);

  CalibrationStep step;
  step.take_up(*read->calibrated, "taken up");
  EXPECT_FALSE(step.found().has_value()) << "nothing could be drawn by it";
  EXPECT_FALSE(step.note().done) << "the window still asks for a calibration";
  EXPECT_NE(step.note().line.find("calibrate anew"), std::string::npos) << step.note().line;
}

}  // namespace
}  // namespace birdseye::host
