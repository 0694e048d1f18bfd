#include "drivers/io/ftdi_port.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"
#include "tests/drivers/io/fake_ft232r.hpp"

namespace birdseye::drivers {
namespace {

using birdseye::testing::FakeFt232r;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

constexpr Duration kUsbPatience = Duration::from_ms(20'000);  // for what must come; no test waits for it to pass

std::unique_ptr<FtdiPort> open(const std::shared_ptr<FakeFt232r>& chip, const FtdiSettings& settings = {}) {
  auto port = FtdiPort::open(FakeFt232r::plug(chip), settings);
  EXPECT_TRUE(port) << (port ? "" : port.error().what);
  return port ? *std::move(port) : nullptr;
}

Bytes read_some(FtdiPort& port) {
  Bytes chunk(1024);
  const auto got = port.read(chunk, device_now() + kUsbPatience);
  EXPECT_TRUE(got) << (got ? "" : got.error().what);
  chunk.resize(got ? *got : 0);
  return chunk;
}

TEST(FtdiPort, OpensByTheSequenceAndNeverAssertsRts) {
  const auto chip = std::make_shared<FakeFt232r>();
  const auto port = open(chip);
  EXPECT_THAT(chip->requests(),
              ElementsAre(SetupPacket{0x40, 0x00, 0x00, 0, 0, 0, 0, 0},     // reset
                          SetupPacket{0x40, 0x01, 0x00, 0x02, 0, 0, 0, 0},  // RTS off
                          SetupPacket{0x40, 0x01, 0x01, 0x01, 0, 0, 0, 0},  // DTR on
                          SetupPacket{0x40, 0x02, 0x00, 0, 0, 0, 0, 0},     // no flow control
                          SetupPacket{0x40, 0x03, 0x1A, 0, 0, 0, 0, 0},     // 115200
                          SetupPacket{0x40, 0x04, 0x08, 0, 0, 0, 0, 0},     // 8N1
                          SetupPacket{0x40, 0x06, 0x00, 0, 0, 0, 0, 0}, SetupPacket{0x40, 0x07, 0x00, 0, 0, 0, 0, 0},
                          SetupPacket{0x40, 0x09, 0x01, 0, 0, 0, 0, 0},  // latency 1 ms, and back
                          SetupPacket{0xC0, 0x0A, 0x00, 0, 0, 0, 1, 0},
                          SetupPacket{0x40, 0x00, 0x01, 0, 0, 0, 0, 0},  // purge both
                          SetupPacket{0x40, 0x00, 0x02, 0, 0, 0, 0, 0}));
  EXPECT_GE(chip->transfers_going, 4);
  EXPECT_LE(chip->transfers_going, 8);
  EXPECT_THAT(port->describe(), HasSubstr("chip FT232R, 115385 baud, latency timer 1 ms"));
  EXPECT_THAT(port->describe(), HasSubstr("TRK001"));
}

TEST(FtdiPort, ResetsTheInstrumentByRts) {
  const auto chip = std::make_shared<FakeFt232r>();
  const auto port = open(chip);
  chip->requests();
  EXPECT_TRUE(port->set_rts(true));
  EXPECT_TRUE(port->set_rts(false));
  EXPECT_THAT(chip->requests(),
              ElementsAre(SetupPacket{0x40, 1, 0x02, 0x02, 0, 0, 0, 0}, SetupPacket{0x40, 1, 0x00, 0x02, 0, 0, 0, 0}));
}

TEST(FtdiPort, TakesTwoMillisecondsFromAChipThatRefusesOne) {
  const auto chip = std::make_shared<FakeFt232r>();
  chip->least_latency_ms = 2;
  EXPECT_THAT(open(chip)->describe(), HasSubstr("latency timer 2 ms instead of 1"));
  chip->least_latency_ms = 16;
  EXPECT_THAT(open(chip)->describe(), HasSubstr("latency timer 16 ms instead of 1"));
  chip->stalls_latency = true;
  EXPECT_THAT(open(chip)->describe(), HasSubstr("no latency timer"));
}

TEST(FtdiPort, SpeaksToTheFirstPortOfALargerChip) {
  const auto chip = std::make_shared<FakeFt232r>();
  chip->identity.bcd_device = 0x0700;
  chip->identity.max_packet = 512;
  const auto port = open(chip);
  const auto requests = chip->requests();
  EXPECT_THAT(requests, ::testing::Contains(SetupPacket{0x40, 3, 0x68, 0xC0, 0x01, 0x02, 0, 0}));
  for (const SetupPacket& request : requests) EXPECT_EQ(request[4], 1);
  Bytes transfer(512 + 3, 0x60);
  transfer[514] = 0x77;
  chip->deliver(transfer);
  EXPECT_EQ(read_some(*port), Bytes(510, 0x60));
  EXPECT_EQ(read_some(*port), Bytes{0x77});
}

TEST(FtdiPort, RefusesAChipItDoesNotKnowAndARateOutOfReach) {
  const auto chip = std::make_shared<FakeFt232r>();
  chip->identity.bcd_device = 0x4711;
  const auto unknown = FtdiPort::open(FakeFt232r::plug(chip), {});
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, Errc::unsupported);
  EXPECT_THAT(unknown.error().what, HasSubstr("4711"));
  EXPECT_TRUE(chip->requests().empty());
  EXPECT_FALSE(chip->claimed);
  chip->identity.bcd_device = 0x0600;
  FtdiSettings settings;
  settings.baud = 50;
  EXPECT_EQ(FtdiPort::open(FakeFt232r::plug(chip), settings).error().code, Errc::bad_value);
  settings.baud = 115200;
  settings.latency_ms = 0;
  EXPECT_EQ(FtdiPort::open(FakeFt232r::plug(chip), settings).error().code, Errc::bad_value);
}

TEST(FtdiPort, CarriesAShortExchange) {
  const auto chip = std::make_shared<FakeFt232r>();
  const auto port = open(chip);
  ASSERT_TRUE(port->write(Bytes{0x4F, 0x00}, device_now() + kUsbPatience));
  EXPECT_EQ(chip->written(), (Bytes{0x4F, 0x00}));
  chip->deliver({0x31, 0x60}, {10});
  chip->deliver({0x31, 0x60, 0x08}, {20});
  chip->deliver({0x31, 0x60, 0xD0}, {30});
  chip->deliver({0x31, 0x60}, {40});
  EXPECT_EQ(read_some(*port), Bytes{0x08});
  EXPECT_EQ(port->arrival()->ns, 20);
  EXPECT_EQ(read_some(*port), Bytes{0xD0});
  EXPECT_EQ(port->arrival()->ns, 30);
  EXPECT_EQ(port->line_errors(), 0U);
}

TEST(FtdiPort, SilenceIsNoErrorWhetherOfEmptyPacketsOrOfNone) {
  const auto chip = std::make_shared<FakeFt232r>();
  const auto port = open(chip);
  Bytes chunk(64);
  EXPECT_EQ(*port->read(chunk, device_now() + Duration::from_ms(5)), 0U);  // an adapter that says nothing at all
  for (int i = 0; i < 50; ++i) chip->deliver({0x01, 0x60});
  ASSERT_TRUE(chip->drained());
  EXPECT_EQ(*port->read(chunk, device_now() + Duration::from_ms(5)), 0U);
  EXPECT_FALSE(port->arrival());
  chip->deliver({0x01, 0x60, 0x42});
  EXPECT_EQ(read_some(*port), Bytes{0x42});
}

TEST(FtdiPort, ALineErrorIsSeenWithTheBytesBehindIt) {
  const auto chip = std::make_shared<FakeFt232r>();
  const auto port = open(chip);
  chip->deliver({0x31, 0x60, 0x01});
  chip->deliver({0x31, 0x68, 0x02});
  chip->deliver({0x31, 0x64});
  chip->fail_transfer();
  chip->deliver({0x31, 0x60, 0x03});
  ASSERT_TRUE(chip->drained());
  EXPECT_EQ(read_some(*port), Bytes{0x01});
  EXPECT_EQ(port->line_errors(), 0U);
  EXPECT_EQ(read_some(*port), Bytes{0x03});
  EXPECT_EQ(port->line_errors(), 2U);
  const FtdiCounters counters = port->counters();
  EXPECT_EQ(counters.packets, 2U);
  EXPECT_EQ(counters.damaged_packets, 1U);
  EXPECT_EQ(counters.empty_errors, 1U);
  EXPECT_EQ(counters.failed_transfers, 1U);
}

TEST(FtdiPort, NobodyReadingCostsMemoryWithinBoundsAndIsALineError) {
  const auto chip = std::make_shared<FakeFt232r>();
  FtdiSettings settings;
  settings.buffer = 1000;
  const auto port = open(chip, settings);
  Bytes packet(64, 0x60);
  for (int i = 0; i < 100; ++i) chip->deliver(packet);
  packet[2] = 0x99;
  chip->deliver(packet);
  ASSERT_TRUE(chip->drained());
  std::size_t bytes = 0;
  bool newest = false;
  Bytes chunk(64);
  for (;;) {
    const auto got = port->read(chunk, device_now() + Duration::from_ms(50));
    ASSERT_TRUE(got);
    if (*got == 0) break;
    bytes += *got;
    newest = newest || chunk[0] == 0x99;
  }
  EXPECT_LE(bytes, 1000U);
  EXPECT_TRUE(newest);
  EXPECT_GE(port->counters().overflows, 1U);
  EXPECT_EQ(port->line_errors(), port->counters().overflows);
}

TEST(FtdiPort, UnpluggingGivesWhatHadComeAndThenTheLoss) {
  const auto chip = std::make_shared<FakeFt232r>();
  const auto port = open(chip);
  chip->deliver({0x01, 0x60, 0x11, 0x22});
  chip->unplug();
  ASSERT_TRUE(chip->seen_gone());
  sleep_for(Duration::from_ms(20));  // so that the loss is known before the bytes are asked for
  EXPECT_EQ(read_some(*port), (Bytes{0x11, 0x22}));
  Bytes chunk(64);
  EXPECT_EQ(port->read(chunk, device_now() + kUsbPatience).error().code, Errc::disconnected);
  EXPECT_EQ(port->read(chunk, device_now() + kUsbPatience).error().code, Errc::disconnected);  // and it stays lost
  EXPECT_EQ(port->write(Bytes{1}, device_now() + kUsbPatience).error().code, Errc::disconnected);
  EXPECT_FALSE(port->set_rts(true));
}

TEST(FtdiPort, UnpluggingWakesAReaderThatWaits) {
  const auto chip = std::make_shared<FakeFt232r>();
  const auto port = open(chip);
  std::jthread pulls([&] {
    sleep_for(Duration::from_ms(20));
    chip->unplug();
  });
  Bytes chunk(64);
  const DeviceTime deadline = device_now() + kUsbPatience;
  EXPECT_EQ(port->read(chunk, deadline).error().code, Errc::disconnected);
  EXPECT_LT(device_now(), deadline);
}

TEST(FtdiPort, UnpluggedWhileOpeningIsAnError) {
  const auto chip = std::make_shared<FakeFt232r>();
  chip->unplug();
  EXPECT_EQ(FtdiPort::open(FakeFt232r::plug(chip), {}).error().code, Errc::disconnected);
}

TEST(FtdiPort, PluggedInAgainIsANewLine) {
  const auto first = std::make_shared<FakeFt232r>();
  auto port = open(first);
  first->unplug();
  Bytes chunk(64);
  EXPECT_FALSE(port->read(chunk, device_now() + kUsbPatience));
  port.reset();
  const auto second = std::make_shared<FakeFt232r>();
  port = open(second);
  EXPECT_EQ(second->requests().size(), 12U);
  second->deliver({0x01, 0x60, 0x33});
  EXPECT_EQ(read_some(*port), Bytes{0x33});
}

TEST(FtdiPort, WritesInPortionsAndGivesUpAtTheDeadline) {
  const auto chip = std::make_shared<FakeFt232r>();
  const auto port = open(chip);
  chip->takes = 3;
  const Bytes command{1, 2, 3, 4, 5, 6, 7};
  ASSERT_TRUE(port->write(command, device_now() + kUsbPatience));
  EXPECT_EQ(chip->written(), command);
  chip->takes = 0;
  EXPECT_EQ(port->write(command, device_now() + Duration::from_ms(5)).error().code, Errc::timeout);
}

TEST(FtdiPort, DiscardsInputAndNoCommandOnItsWayOut) {
  const auto chip = std::make_shared<FakeFt232r>();
  const auto port = open(chip);
  chip->requests();
  for (int i = 0; i < 10; ++i) chip->deliver({0x01, 0x60, 0x44});
  ASSERT_TRUE(chip->drained());
  port->discard_input();
  EXPECT_TRUE(chip->requests().empty());  // a purge might be the output's
  chip->deliver({0x01, 0x60, 0x55});
  EXPECT_EQ(read_some(*port), Bytes{0x55});
}

TEST(FtdiPort, ClosesWhileInputComes) {
  for (int round = 0; round < 50; ++round) {
    const auto chip = std::make_shared<FakeFt232r>();
    std::jthread sends([&](const std::stop_token& stop) {
      for (int i = 0; i < 2000 && !stop.stop_requested(); ++i) chip->deliver({0x01, 0x60, 0x01});
    });
    auto port = open(chip);
    port.reset();
    EXPECT_FALSE(chip->claimed);
    EXPECT_EQ(chip.use_count(), 1);  // nobody is left to call back
  }
}

}  // namespace
}  // namespace birdseye::drivers
