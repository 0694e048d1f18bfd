#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <thread>

#include "drivers/minibird/minibird.hpp"
#include "tests/drivers/minibird/scripted_unit.hpp"

namespace birdseye::drivers::minibird {
namespace {

using birdseye::testing::ScriptedUnit;
using birdseye::testing::without_waits;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct Started {
  ScriptedUnit* unit;
  Result<std::unique_ptr<MiniBird>> bird;
};

Started start(const std::function<void(ScriptedUnit&)>& set_up, const MiniBirdSettings& settings = without_waits()) {
  auto line = std::make_unique<ScriptedUnit>();
  ScriptedUnit* const unit = line.get();
  set_up(*unit);
  return {unit, MiniBird::start(std::move(line), settings)};
}

/// As a unit is that was left streaming by the same settings.
void left_running(ScriptedUnit& unit) {
  unit.answers[0] = {0x0A, 0xD0};  // position and matrix
  unit.streaming = true;
}

TEST(MiniBirdStart, AUnitThatIsAsWantedIsNotReset) {
  const auto [unit, bird] = start(left_running);
  ASSERT_TRUE(bird) << bird.error().what;
  EXPECT_TRUE((*bird)->info().warm) << (*bird)->info().not_warm;
  EXPECT_EQ(unit->resets, 0);
  EXPECT_TRUE(unit->streaming);
  EXPECT_EQ((*bird)->info().model, "6DFOB");
  EXPECT_EQ((*bird)->info().units[0].unit_serial, 12345);
  EXPECT_EQ((*bird)->info().units[0].sensor_serial, std::nullopt);  // 3.71 and later
  EXPECT_EQ((*bird)->layout().birds.size(), 1U);
  EXPECT_DOUBLE_EQ((*bird)->layout().rate_hz, 103.296875);
}

TEST(MiniBirdStart, AUnitThatDiffersInAnythingIsReset) {
  const std::pair<std::uint8_t, Bytes> kOthers[] = {
      {0x00, {0x08, 0xD0}}, {0x00, {0x4A, 0xD0}}, {0x03, {1, 0}},      {0x04, {7, 0}},
      {0x07, {0x00, 0x64}}, {0x08, {1}},          {0x11, {1}},         {0x14, {50}},
      {0x16, {12, 0}},      {0x17, Bytes(6, 1)},  {0x18, Bytes(6, 1)}, {0x23, {1}},
  };
  for (const auto& [parameter, value] : kOthers) {
    const auto [unit, bird] = start([&, p = parameter, v = value](ScriptedUnit& u) {
      left_running(u);
      u.answers[p] = v;
    });
    ASSERT_TRUE(bird) << int{parameter} << bird.error().what;
    EXPECT_EQ(unit->resets, 1) << int{parameter};
    EXPECT_FALSE((*bird)->info().not_warm.empty());
    EXPECT_EQ(unit->answers[0][0], 0x0A) << int{parameter};
    EXPECT_EQ(unit->answers[parameter == 0 ? 0x16 : parameter], unit->fresh[parameter == 0 ? 0x16 : parameter]);
  }
}

TEST(MiniBirdStart, SetsAllThatIsAskedFor) {
  MiniBirdSettings settings = without_waits();
  settings.hemisphere = Hemisphere::lower;
  settings.wide_scale = true;
  settings.rate_hz = 138;
  settings.report_every = 2;
  settings.filters = FilterSettings{};
  settings.filters->ac_wide_notch = false;
  settings.filters->dc_vm = {2, 6, 26, 99, 396, 1615, 6460};
  settings.filters->dc_alpha_min = {0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.02};
  settings.filters->dc_alpha_max = {0.9, 0.9, 0.9, 0.9, 0.9, 0.9, 0.9};
  settings.line_frequency_hz = 50;
  settings.per_bird = {{std::nullopt, std::nullopt, AnglesDeg{5, 10, 15}}};
  settings.reference_frame = AnglesDeg{90, 0, -45};
  settings.reference_frame_turns_position = true;
  settings.sudden_change_lock = true;
  const auto [unit, bird] = start([](ScriptedUnit&) {}, settings);
  ASSERT_TRUE(bird) << bird.error().what;
  const auto has = [u = unit](std::uint8_t parameter) { return u->answers[parameter]; };
  EXPECT_EQ(has(0x16), (Bytes{0x0C, 0x00}));
  EXPECT_EQ(has(0x03), (Bytes{1, 0}));
  EXPECT_EQ(has(0x07), (Bytes{0x00, 0x8A}));
  EXPECT_EQ(has(0x04), (Bytes{6, 0}));
  EXPECT_EQ(has(0x0C), (Bytes{2, 0, 6, 0, 0x1A, 0, 0x63, 0, 0x8C, 1, 0x4F, 6, 0x3C, 0x19}));  // T27
  EXPECT_EQ(has(0x05)[0], 0x8F);
  EXPECT_EQ(has(0x05)[1], 0x02);
  EXPECT_EQ(has(0x0D)[0], 0x33);
  EXPECT_EQ(has(0x0D)[1], 0x73);
  EXPECT_EQ(has(0x14), (Bytes{50}));                                  // T28
  EXPECT_EQ(has(0x17), (Bytes{0x8E, 0x03, 0x1C, 0x07, 0xAA, 0x0A}));  // T23
  EXPECT_EQ(has(0x18), (Bytes{0x00, 0x40, 0x00, 0x00, 0x00, 0xE0}));  // T24
  EXPECT_EQ(has(0x11), (Bytes{1}));
  EXPECT_EQ(has(0x0E), (Bytes{1}));
  EXPECT_TRUE(unit->was_sent({'R'}));
  EXPECT_DOUBLE_EQ((*bird)->layout().rate_hz, 69);
  EXPECT_DOUBLE_EQ((*bird)->layout().birds[0].mm_per_count, kMmPerCount72Inch);
  // The lower half-space is +Z of the transmitter; told along axes that are turned by the reference frame.
  const Eigen::Vector3d down =
      rotation_from_angles(1.5707963267948966, 0, -0.7853981633974483).transpose() * Eigen::Vector3d::UnitZ();
  EXPECT_LT(((*bird)->layout().birds[0].into_hemisphere - down).norm(), 1e-9);
}

TEST(MiniBirdStart, T29EndsInFormatReportRateRunAndStream) {
  const auto [unit, bird] = start([](ScriptedUnit&) {});
  ASSERT_TRUE(bird) << bird.error().what;
  const auto at = [u = unit](const Bytes& command) {
    return std::find(u->commands.rbegin(), u->commands.rend(), command) - u->commands.rbegin();
  };
  EXPECT_EQ(unit->commands.back(), Bytes{'@'});
  EXPECT_GT(at({'Z'}), at({'Q'}));
  EXPECT_GT(at({'Q'}), at({'F'}));
  EXPECT_GT(at({'F'}), at({'@'}));
}

TEST(MiniBirdStart, OldFirmwareIsAskedOnlyWhatItKnows) {
  MiniBirdSettings settings = without_waits();
  settings.line_frequency_hz = 50;
  settings.hemisphere = Hemisphere::aft;
  const auto [unit, bird] = start(
      [](ScriptedUnit& u) {
        u.fresh[1] = {3, 30};
        for (const int unknown : {0x07, 0x11, 0x14, 0x16, 0x17, 0x18, 0x19, 0x23})
          u.fresh.erase(static_cast<std::uint8_t>(unknown));
        u.knows_expanded_errors = false;
        u.answers = u.fresh;
      },
      settings);
  ASSERT_TRUE(bird) << bird.error().what;
  EXPECT_TRUE(unit->was_sent({'L', 0x00, 0x01}));
  EXPECT_TRUE(unit->was_sent({'P', 0x06, 0xCD, 0x2D}));  // T21: 103.3 Hz by the count of a 40 MHz crystal
  for (const int unknown : {0x07, 0x11, 0x14, 0x16, 0x17, 0x18, 0x19, 0x1A, 0x1B, 0x23}) {
    EXPECT_FALSE(unit->was_sent({'O', static_cast<std::uint8_t>(unknown)})) << unknown;
  }
  EXPECT_NEAR((*bird)->info().rate_hz, 103.306, 1e-3);
  EXPECT_EQ((*bird)->info().latched_error, "");
  ASSERT_EQ((*bird)->info().notes.size(), 1U);
  EXPECT_THAT((*bird)->info().notes[0], HasSubstr("line frequency"));
  EXPECT_THAT((*bird)->info().notes[0], HasSubstr("3.30"));
}

TEST(MiniBirdStart, AFirmwareThatLacksTheRateParameterAfterAllTakesTheCount) {
  const auto [unit, bird] = start([](ScriptedUnit& u) {
    u.fresh.erase(0x07);
    u.answers = u.fresh;
  });
  ASSERT_TRUE(bird) << bird.error().what;
  EXPECT_NEAR((*bird)->info().rate_hz, 103.306, 1e-3);
}

TEST(MiniBirdStart, AHemisphereThatIsNotTakenIsNamed) {
  MiniBirdSettings settings = without_waits();
  settings.hemisphere = Hemisphere::upper;
  const auto [unit, bird] = start([](ScriptedUnit& u) { u.stubborn = {0x16}; }, settings);
  ASSERT_FALSE(bird);
  EXPECT_EQ(bird.error().code, Errc::bad_value);
  EXPECT_THAT(bird.error().what, HasSubstr("hemisphere"));
}

TEST(MiniBirdStart, ARateThatIsNotTakenIsNamed) {
  MiniBirdSettings settings = without_waits();
  settings.rate_hz = 50;
  const auto [unit, bird] = start([](ScriptedUnit& u) { u.stubborn = {0x07}; }, settings);
  ASSERT_FALSE(bird);
  EXPECT_THAT(bird.error().what, HasSubstr("103.3"));
}

TEST(MiniBirdStart, AFlockIsGatheredAndEachBirdSet) {
  MiniBirdSettings settings = without_waits(2);
  settings.per_bird = {{}, {std::nullopt, Hemisphere::left, std::nullopt}};
  const auto [unit, bird] = start(
      [](ScriptedUnit& u) {
        u.units = 2;
        u.fresh[0x24] = {0xE1, 0xE0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};  // T26
        u.answers = u.fresh;
      },
      settings);
  ASSERT_TRUE(bird) << bird.error().what;
  EXPECT_TRUE(unit->was_sent({'/'}));
  EXPECT_TRUE(unit->was_sent({'P', 0x32, 2}));
  EXPECT_TRUE(unit->was_sent({0xF1, 'Z'}));
  EXPECT_TRUE(unit->was_sent({0xF2, 'Z'}));
  EXPECT_TRUE(unit->was_sent({0xF1, 'L', 0, 0}));
  EXPECT_TRUE(unit->was_sent({0xF2, 'L', 6, 1}));
  EXPECT_TRUE(unit->was_sent({'P', 0x23, 1}));
  EXPECT_TRUE((*bird)->layout().group_mode);
  EXPECT_LT(((*bird)->layout().birds[1].into_hemisphere + Eigen::Vector3d::UnitY()).norm(), 1e-12);
}

TEST(MiniBirdStart, AnExtendedRangeControllerIsRefused) {
  const auto [unit, bird] = start(
      [](ScriptedUnit& u) {
        u.fresh[0x24] = {0xE1, 0xD1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
        u.answers = u.fresh;
      },
      without_waits(2));
  ASSERT_FALSE(bird);
  EXPECT_EQ(bird.error().code, Errc::unsupported);
}

TEST(MiniBirdStart, RecordsOfAnotherLengthAreAnError) {
  const auto [unit, bird] = start([](ScriptedUnit& u) { u.buttons = true; });
  ASSERT_FALSE(bird);
  EXPECT_THAT(bird.error().what, HasSubstr("25 bytes instead of 24"));
}

TEST(MiniBirdStart, ButtonModeMakesRecordsLonger) {
  MiniBirdSettings settings = without_waits();
  settings.button_byte = true;
  const auto [unit, bird] = start([](ScriptedUnit& u) { u.buttons = true; }, settings);
  ASSERT_TRUE(bird) << bird.error().what;
  EXPECT_TRUE(unit->was_sent({'M', 1}));
  EXPECT_TRUE((*bird)->layout().button_byte);
}

TEST(MiniBirdStart, T25LatchedErrorsAreToldInWords) {
  const auto [unit, bird] = start([](ScriptedUnit& u) { u.errors = {{0x0D, 0x03}, {0x20, 0x00}}; });
  ASSERT_TRUE(bird) << bird.error().what;
  EXPECT_THAT((*bird)->info().latched_error, HasSubstr("no response from a unit on the bus (unit 3)"));
  EXPECT_THAT((*bird)->info().latched_error, HasSubstr("saturated"));
  EXPECT_TRUE(unit->errors.empty());
}

TEST(MiniBirdStart, HalfAReplyIsAskedForAgain) {
  const auto [unit, bird] = start([](ScriptedUnit& u) { u.half_replies = 2; });
  ASSERT_TRUE(bird) << bird.error().what;
}

TEST(MiniBirdStart, LateAnswersAreNotTakenForOthers) {
  // In time, if only just.
  const auto [unit, bird] = start([](ScriptedUnit& u) { u.late = Duration::from_ms(10); },
                                  [] {
                                    MiniBirdSettings settings = without_waits();
                                    settings.quiet = Duration::from_ms(15);
                                    return settings;
                                  }());
  ASSERT_TRUE(bird) << bird.error().what;
  EXPECT_EQ((*bird)->info().model, "6DFOB");
  // Always too late: refused, not misunderstood.
  const auto too_late = start([](ScriptedUnit& u) { u.late = Duration::from_ms(60); }).bird;
  ASSERT_FALSE(too_late);
}

TEST(MiniBirdStart, WithoutAResetLineEverythingIsSaid) {
  const auto [unit, bird] = start([](ScriptedUnit& u) {
    u.has_rts = false;
    left_running(u);
    u.answers[0x17] = Bytes(6, 1);
    u.answers[0x14] = {50};
    u.answers[0x03] = {1, 0};
  });
  ASSERT_TRUE(bird) << bird.error().what;
  EXPECT_FALSE((*bird)->info().has_reset_line);
  EXPECT_FALSE((*bird)->info().warm);
  EXPECT_EQ(unit->answers[0x17], Bytes(6, 0));
  EXPECT_EQ(unit->answers[0x14], Bytes{60});
  EXPECT_EQ(unit->answers[0x03], (Bytes{0, 0}));
}

TEST(MiniBirdStart, AStopEndsItEarly) {
  auto line = std::make_unique<ScriptedUnit>();
  line->mute = true;
  MiniBirdSettings settings;  // with all the waits: seconds
  std::stop_source source;
  std::jthread stopper([&source] {
    sleep_for(Duration::from_ms(30));
    source.request_stop();
  });
  const auto bird = MiniBird::start(std::move(line), settings, source.get_token());
  ASSERT_FALSE(bird);
  EXPECT_THAT(bird.error().what, HasSubstr("stopped"));
}

TEST(MiniBirdStart, SettingsThatCannotBeAreAllNamed) {
  MiniBirdSettings settings = without_waits();
  settings.rate_hz = 200;
  settings.report_every = 3;
  settings.line_frequency_hz = 55;
  settings.filters = FilterSettings{};
  settings.filters->dc_alpha_min = {0.02, 0.02, 0.02, 0.02, 0.02, 0.02, 0.95};
  settings.filters->dc_alpha_max = {0.9, 0.9, 0.9, 0.9, 0.9, 0.9, 0.9};
  const auto [unit, bird] = start([](ScriptedUnit&) {}, settings);
  ASSERT_FALSE(bird);
  for (const char* word : {"rate_hz", "report_every", "line_frequency_hz", "dc_alpha_min: not below"}) {
    EXPECT_THAT(bird.error().what, HasSubstr(word));
  }
  EXPECT_TRUE(faults_of(without_waits(2)).empty());
  settings = without_waits(4);
  settings.rate_hz = 144;  // 4 x 25 bytes x 10 bits
  EXPECT_THAT(faults_of(settings), ElementsAre(HasSubstr("does not fit")));
}

TEST(MiniBirdTrouble, ASaturatedSensorIsToldAndTheStreamGoesOn) {
  const auto [unit, bird] = start([](ScriptedUnit&) {});
  ASSERT_TRUE(bird) << bird.error().what;
  unit->errors = {{0x20, 0x00}};
  const auto diagnosis = (*bird)->diagnose();
  ASSERT_TRUE(diagnosis) << diagnosis.error().what;
  EXPECT_THAT(diagnosis->words, HasSubstr("sensor saturated"));
  EXPECT_FALSE(diagnosis->needs_start);
  ASSERT_EQ(diagnosis->errors.size(), 1U);
  EXPECT_EQ(diagnosis->errors[0].code, 32);
  EXPECT_TRUE(unit->streaming);
  const auto chunk = (*bird)->read(device_now() + Duration::from_ms(100));
  ASSERT_TRUE(chunk && *chunk);
  EXPECT_TRUE((*chunk)->after_restart);
  EXPECT_FALSE((*(*bird)->read(device_now() + Duration::from_ms(100)))->after_restart);
}

TEST(MiniBirdTrouble, AUnitThatHasLostItsSettingsNeedsAStart) {
  const auto [unit, bird] = start([](ScriptedUnit&) {});
  ASSERT_TRUE(bird) << bird.error().what;
  unit->answers = unit->fresh;  // switched off and on
  unit->streaming = false;
  const auto diagnosis = (*bird)->diagnose();
  ASSERT_TRUE(diagnosis) << diagnosis.error().what;
  EXPECT_TRUE(diagnosis->needs_start);
  EXPECT_THAT(diagnosis->words, HasSubstr("lost its settings"));
  EXPECT_FALSE(unit->streaming);
}

TEST(MiniBirdTrouble, AFatalErrorNeedsAStart) {
  const auto [unit, bird] = start([](ScriptedUnit&) {});
  ASSERT_TRUE(bird) << bird.error().what;
  unit->errors = {{1, 0}};
  EXPECT_TRUE((*bird)->diagnose()->needs_start);
}

TEST(MiniBirdTrouble, AUnitThatHasGoneSaysNothing) {
  const auto [unit, bird] = start([](ScriptedUnit&) {});
  ASSERT_TRUE(bird) << bird.error().what;
  unit->mute = true;
  unit->streaming = false;
  EXPECT_EQ((*bird)->diagnose().error().code, Errc::timeout);
}

TEST(MiniBirdTrouble, AUnitThatSleepsIsWoken) {
  const auto [unit, bird] = start([](ScriptedUnit&) {});
  ASSERT_TRUE(bird) << bird.error().what;
  unit->asleep = true;
  ASSERT_TRUE((*bird)->diagnose());
  EXPECT_FALSE(unit->asleep);
  EXPECT_TRUE((*(*bird)->read(device_now() + Duration::from_ms(100)))->after_restart);
}

TEST(MiniBirdTrouble, DamageOnTheLineIsToldWithTheNextBytes) {
  const auto [unit, bird] = start([](ScriptedUnit&) {});
  ASSERT_TRUE(bird) << bird.error().what;
  const auto after_error = [&b = *bird] { return (*b->read(device_now() + Duration::from_ms(100)))->after_line_error; };
  EXPECT_FALSE(after_error());
  ++unit->damaged;
  EXPECT_TRUE(after_error());
  EXPECT_FALSE(after_error());
}

}  // namespace
}  // namespace birdseye::drivers::minibird
