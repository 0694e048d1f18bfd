#include "hw-sim/operation/operation_recording.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "device/birdseyed/recording.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"
#include "tests/hw-sim/operation/operations.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::hw_sim {
namespace {

TEST(OperationRecording, WhatTheApplianceRecordsGivesAgainWhatTheWindowSaw) {
  const auto script = programs_end({usual(FaultKind::appliance_restart, 50, 3), {FaultKind::link_cut, 70, {}, {}}});
  const OperationOutcome out = operate({.seed = 11, .minutes = 1.5, .faults = script, .records = true});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.recordings, 2U);
  EXPECT_GT(out.found_again, 3000U);
  EXPECT_EQ(out.hash, operate({.seed = 11, .minutes = 1.5, .faults = script, .records = true}).hash);
}

TEST(OperationRecording, APowerCutOfTheApplianceIsSurvivedByAllButTheLastSecond) {
  const auto script = programs_end({usual(FaultKind::appliance_power_cut, 50, 6)});
  const OperationOutcome out = operate({.seed = 12, .minutes = 1.5, .faults = script, .records = true});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.recordings, 2U);
  EXPECT_NE(out.log.find("the video has stopped"), std::string::npos) << "nothing says that the appliance has gone";
  EXPECT_NE(out.log.find("the overlay is whole", out.log.find("ends: program appliance_power_cut")), std::string::npos);
}

TEST(OperationRecording, ADiskThatIsLateLosesNothing) {
  const auto script = programs_end(
      {usual(FaultKind::appliance_disk_late, 45, 20, {{"ms", 400}}), usual(FaultKind::appliance_restart, 60, 3)});
  const OperationOutcome out = operate({.seed = 13, .minutes = 1.5, .faults = script, .records = true});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.recordings, 2U);
  EXPECT_GT(out.found_again, 3000U);
}

/// The next recording cannot be begun either; the one after it can.
TEST(OperationRecording, ADiskThatIsFullEndsTheRecordingAndNothingElse) {
  const auto script =
      programs_end({usual(FaultKind::appliance_disk_full, 45, 15), usual(FaultKind::appliance_restart, 55, 3),
                    usual(FaultKind::appliance_restart, 70, 3)});
  const OperationOutcome out = operate({.seed = 13, .minutes = 1.5, .faults = script, .records = true});
  EXPECT_TRUE(out.broken.empty()) << told(out);
  EXPECT_EQ(out.recordings, 2U);
  EXPECT_GT(static_cast<double>(out.laws.green), 0.4 * static_cast<double>(out.laws.shown)) << out.log;
}

/// What an appliance records whose pedal is pressed.
class Recorded : public ::testing::Test {
 protected:
  Recorded() {
    auto made = law_.config().create(law_.config().folder);
    EXPECT_TRUE(made) << made.error().what;
    file_ = std::move(made->file);
    machine_ = made->machine;
    put(device::recording_magic());
    put(device::block_of(device::CoreSettings{}));
  }
  void press(bool is_recorded) {
    sleep_for(Duration::from_ms(2));
    const DeviceTime at = device_now();
    const drivers::GpioEdge edge{drivers::GpioInput::pedal, true, at};
    if (is_recorded) put(device::block_of(device::EdgesCame{{edge}, at}));
    law_.take(wire::Pedal{true, at}, host_now());
  }
  void sign() {
    EXPECT_EQ(file_->write(device::block_of(machine_->sign(calibration::kApplianceRecordingFormat, sum_.hex()))), 0);
  }
  void put(const device::Bytes& bytes) {
    EXPECT_EQ(file_->write(bytes), 0);
    sum_.add(bytes);
  }
  void befall(FaultKind kind) {
    FaultTimeline befalling({usual(kind, 0, 10)}, FaultTarget::program);
    befalling.begin(0);
    befalling.advance(1'000'000'000);
    law_.befall(befalling, host_now());
  }
  std::string judged() {
    file_.reset();
    return law_.judge();
  }

  birdseye::testing::Scratch scratch_;
  OperationRecording law_{scratch_.path(), 1};
  std::unique_ptr<device::RecordFile> file_;
  std::optional<ThisMachine> machine_;
  calibration::Sha256 sum_;
};

TEST_F(Recorded, IsGoodWhereItHasAllAndIsSigned) {
  for (int i = 0; i < 5; ++i) press(true);
  sign();
  EXPECT_EQ(judged(), "");
  EXPECT_EQ(law_.found_again(), 5U);
}

TEST_F(Recorded, IsToldToLackAnEventInItsMiddle) {
  for (int i = 0; i < 5; ++i) press(i != 2);
  sign();
  EXPECT_NE(judged().find("of 5 events of kind 4 that reached the host, the recording gives 2 again"),
            std::string::npos);
}

TEST_F(Recorded, IsToldToBeSignedByNobody) {
  press(true);
  EXPECT_TRUE(judged().starts_with("the recording is not signed"));
}

TEST_F(Recorded, MayLackTheLastSecondBeforeAPowerCutAndNoMore) {
  press(true);
  EXPECT_EQ(file_->sync(), 0);
  press(true);
  law_.lose_power(host_now());
  EXPECT_EQ(judged(), "");
}

TEST_F(Recorded, MayLackWhatCameOnceTheDiskWasFull) {
  press(true);
  befall(FaultKind::appliance_disk_full);
  press(false);
  EXPECT_EQ(judged(), "");
}

TEST_F(Recorded, IsToldToLackWhatCameBeforeTheDiskWasFull) {
  press(false);
  befall(FaultKind::appliance_disk_full);
  EXPECT_NE(judged().find("of 1 events of kind 4 that reached the host, the recording gives 0 again"),
            std::string::npos);
}

TEST_F(Recorded, IsToldWhereNobodySaysThatTheDiskIsFull) {
  befall(FaultKind::appliance_disk_full);
  const HostTime now = host_now();
  sleep_for(Duration::from_ms(2));
  law_.take(wire::Birds{device_now(), {}}, now);
  wire::Health health;
  health.recording = "/records/1.berec";
  law_.take(health, now + Duration::from_ms(2500));
  EXPECT_EQ(judged(), "the disk was full, and the appliance has not said within 2 s that the recording has ended");
}

TEST_F(Recorded, IsToldWhereMoreThanTheLastSecondIsLost) {
  press(false);
  law_.lose_power(host_now() + Duration::from_ms(1500));
  EXPECT_NE(judged().find("and the power went at"), std::string::npos);
}

}  // namespace
}  // namespace birdseye::hw_sim
