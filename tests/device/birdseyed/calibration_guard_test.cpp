#include "device/birdseyed/calibration_guard.hpp"

#include <gtest/gtest.h>

#include "device/birdseyed/core.hpp"
#include "device/wire/client.hpp"
#include "device/wire/server.hpp"
#include "device/wire/unpacker.hpp"
#include "drivers/system/wait.hpp"
#include "tests/support/example_record.hpp"

namespace birdseye::device {
namespace {

const calibration::Identity kTracker{{"model", "miniBIRD"}, {"bird1_sensor_serial", "4711"}};
const calibration::Identity kCamera{{"model", "Scope cam"}, {"serial", "A1"}};

std::string record() {
  return record_text(testing::example_record(4, 2, kTracker, kCamera));
}

InstrumentChanged runs(Instrument instrument, const calibration::Identity& identity) {
  return {.instrument = instrument, .state = InstrumentState::running, .text = "here", .at = {1}, .identity = identity};
}

TEST(CalibrationGuard, IsInForceOnceAllThatItWasMadeWithIsThere) {
  CalibrationGuard guard(record());
  auto told = guard.take_change();
  ASSERT_TRUE(told);
  EXPECT_FALSE(told->in_force);
  EXPECT_TRUE(told->record.empty());
  guard.note(runs(Instrument::tracker, kTracker));
  EXPECT_NE(guard.take_change()->why_not.find("camera"), std::string::npos);
  guard.note(runs(Instrument::camera, kCamera));
  EXPECT_NE(guard.take_change()->why_not.find("frame"), std::string::npos);
  guard.note_frame(4, 2);
  told = guard.take_change();
  ASSERT_TRUE(told);
  EXPECT_TRUE(told->in_force) << told->why_not;
  EXPECT_EQ(told->record, record());
  EXPECT_EQ(guard.fault(), "");
  guard.note_frame(4, 2);
  EXPECT_FALSE(guard.take_change());
}

TEST(CalibrationGuard, ARecordThatIsRefusedIsNotInForceWhateverIsHere) {
  CalibrationGuard guard(record(), "record.json: the record is not signed");
  guard.note(runs(Instrument::tracker, kTracker));
  guard.note(runs(Instrument::camera, kCamera));
  guard.note_frame(4, 2);
  const auto told = guard.take_change();
  ASSERT_TRUE(told);
  EXPECT_FALSE(told->in_force);
  EXPECT_TRUE(told->record.empty());
  EXPECT_EQ(told->why_not, "calibration: record.json: the record is not signed");
  EXPECT_EQ(guard.latency(), nullptr);
}

TEST(CalibrationGuard, ARecordThatNoMessageHoldsIsNotInForceAndTheReasonIsSaid) {
  calibration::CalibrationRecord large = testing::example_record(4, 2, kTracker, kCamera);
  large.scope = std::string(20'000, '"');  // of which JSON in JSON makes four characters each
  CalibrationGuard guard(record_text(large));
  guard.note(runs(Instrument::tracker, kTracker));
  guard.note(runs(Instrument::camera, kCamera));
  guard.note_frame(4, 2);
  const auto told = guard.take_change();
  ASSERT_TRUE(told);
  EXPECT_FALSE(told->in_force);
  EXPECT_TRUE(told->record.empty());
  EXPECT_NE(told->why_not.find("a message that holds 65000"), std::string::npos) << told->why_not.substr(0, 200);
  EXPECT_LT(told->why_not.size(), 300U);
}

TEST(CalibrationGuard, AnotherSensorCameraOrSizeOfFrameTakesItOutOfForce) {
  const auto after = [](auto&& change) {
    CalibrationGuard guard(record());
    guard.note(runs(Instrument::tracker, kTracker));
    guard.note(runs(Instrument::camera, kCamera));
    guard.note_frame(4, 2);
    EXPECT_TRUE(guard.take_change()->in_force);
    change(guard);
    const auto told = guard.take_change();
    EXPECT_TRUE(told && !told->in_force && told->record.empty());
    return guard.fault();
  };
  EXPECT_NE(after([](auto& g) {
              g.note(runs(Instrument::tracker, {{"model", "miniBIRD"}, {"bird1_sensor_serial", "1"}}));
            }).find("4711"),
            std::string::npos);
  EXPECT_NE(after([](auto& g) {
              g.note(runs(Instrument::camera, {{"model", "Scope cam"}}));
            }).find("serial A1"),
            std::string::npos);
  EXPECT_NE(after([](auto& g) { g.note_frame(8, 2); }).find("4 x 2"), std::string::npos);
}

TEST(CalibrationGuard, WithoutARecordThatIsSaidAndNothingIsAmiss) {
  CalibrationGuard guard("");
  const auto told = guard.take_change();
  ASSERT_TRUE(told);
  EXPECT_FALSE(told->in_force);
  EXPECT_EQ(guard.fault(), "");
}

TEST(CalibrationGuard, TheCoreRefusesAForeignRecordInItsStatus) {
  CoreSettings settings;
  settings.calibration = record();
  Core core(settings);
  std::optional<wire::Calibration> told;
  wire::Unpacker unpacker;
  const auto take = [&](const RawEvent& event) {
    for (const wire::Packet& packet : core.take(event)) {
      const auto bytes = packet.bytes();
      const auto event_told = unpacker.push(bytes);
      ASSERT_TRUE(event_told);
      if (!*event_told) continue;
      if (const auto* e = std::get_if<wire::Event>(&**event_told))
        if (const auto* calibration = std::get_if<wire::Calibration>(e)) told = *calibration;
    }
  };
  take(runs(Instrument::tracker, kTracker));
  take(runs(Instrument::camera, {{"model", "another"}}));
  ASSERT_TRUE(told);
  EXPECT_FALSE(told->in_force);
  EXPECT_NE(core.status_text().find("Scope cam"), std::string::npos) << core.status_text();
  EXPECT_NE(core.status_text().find("another"), std::string::npos) << core.status_text();
}

TEST(CalibrationGuard, AClientThatComesLaterIsTold) {
  auto server = wire::Server::listen("127.0.0.1", 0);
  ASSERT_TRUE(server);
  (*server)->publish(wire::pack(wire::Calibration{true, "", record()}, {5}));
  sleep_for(Duration::from_ms(50));  // distributed to nobody
  const auto deadline = Deadline::after(Duration::from_ms(5000));
  auto client = wire::Client::connect("127.0.0.1", (*server)->port(), deadline);
  ASSERT_TRUE(client);
  for (;;) {
    auto event = (*client)->next(deadline);
    ASSERT_TRUE(event && *event);
    if (const auto* told = std::get_if<wire::Calibration>(&**event)) {
      EXPECT_EQ(told->record, record());
      return;
    }
  }
}

}  // namespace
}  // namespace birdseye::device
