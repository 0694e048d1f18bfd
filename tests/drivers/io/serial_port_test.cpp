#include "drivers/io/serial_port.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <termios.h>

#include <fstream>
#include <random>
#include <thread>

#include "drivers/io/serial_latency.hpp"
#include "drivers/io/serial_marks.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::drivers {
namespace {

using ::testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

constexpr Duration kSerialPatience = Duration::from_ms(20'000);

/// The instrument's end of a pseudo-terminal, and the path of the other. The real line discipline is between them.
struct Terminal {
  Terminal() : ours(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    ::grantpt(ours.get());
    ::unlockpt(ours.get());
    std::array<char, 128> name{};
    ::ptsname_r(ours.get(), name.data(), name.size());
    path = name.data();
  }
  void send(const Bytes& bytes) const {
    ASSERT_EQ(::write(ours.get(), bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }

  UniqueFd ours;
  std::string path;
};

Bytes read_count(SerialPort& port, std::size_t count) {
  Bytes all, chunk(4096);
  const DeviceTime deadline = device_now() + kSerialPatience;
  while (all.size() < count) {
    const auto got = port.read(chunk, deadline);
    if (!got || *got == 0) break;
    all.insert(all.end(), chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(*got));
  }
  return all;
}

TEST(SerialPort, CarriesEveryByteBothWays) {
  const Terminal terminal;
  const auto port = SerialPort::open(terminal.path, 115200);
  ASSERT_TRUE(port) << port.error().what;
  Bytes sent;
  std::mt19937 random(7);
  for (int i = 0; i < 256; ++i) sent.push_back(static_cast<std::uint8_t>(i));
  for (int i = 0; i < 64; ++i) sent.insert(sent.end(), {0xFF, 0x00, static_cast<std::uint8_t>(random() % 2 * 0xFF)});
  terminal.send(sent);
  EXPECT_EQ(read_count(**port, sent.size()), sent);  // FF came doubled, and FF 00 was no mark
  EXPECT_EQ((*port)->line_errors(), 0U);
  ASSERT_TRUE((*port)->write(sent, device_now() + kSerialPatience));
  Bytes back(sent.size());
  std::size_t have = 0;
  while (have < back.size()) {
    const ssize_t got = ::read(terminal.ours.get(), back.data() + have, back.size() - have);
    ASSERT_GT(got, 0);
    have += static_cast<std::size_t>(got);
  }
  EXPECT_EQ(back, sent);
  EXPECT_THAT((*port)->describe(), HasSubstr("damaged bytes marked"));
}

TEST(SerialPort, IsOneProgramsAlone) {
  const Terminal terminal;
  const auto port = SerialPort::open(terminal.path, 115200);
  ASSERT_TRUE(port);
  const auto second = SerialPort::open(terminal.path, 115200);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, Errc::in_use);
}

TEST(SerialPort, AHangUpWakesAReaderThatWaits) {
  auto terminal = std::make_unique<Terminal>();
  const auto port = SerialPort::open(terminal->path, 115200);
  ASSERT_TRUE(port);
  std::jthread pulls([&] {
    sleep_for(Duration::from_ms(20));
    terminal.reset();
  });
  Bytes chunk(64);
  const DeviceTime deadline = device_now() + kSerialPatience;
  EXPECT_EQ((*port)->read(chunk, deadline).error().code, Errc::disconnected);
  EXPECT_LT(device_now(), deadline);
  EXPECT_EQ((*port)->write(chunk, device_now() + kSerialPatience).error().code, Errc::disconnected);
}

TEST(SerialPort, APeerThatTakesNothingIsATimeout) {
  const Terminal terminal;
  const auto port = SerialPort::open(terminal.path, 115200);
  ASSERT_TRUE(port);
  EXPECT_EQ((*port)->write(Bytes(1U << 20, 0x42), device_now() + Duration::from_ms(50)).error().code, Errc::timeout);
}

TEST(SerialPort, DiscardsWhatHasCome) {
  const Terminal terminal;
  const auto port = SerialPort::open(terminal.path, 115200);
  ASSERT_TRUE(port);
  terminal.send({1, 2, 3, 4});
  Bytes one(1);
  ASSERT_EQ(*(*port)->read(one, device_now() + kSerialPatience), 1U);
  (*port)->discard_input();
  terminal.send({9});
  EXPECT_EQ(read_count(**port, 1), Bytes{9});
}

Bytes with_marks(const Bytes& sound) {
  Bytes marked;
  for (const std::uint8_t byte : sound) {
    marked.push_back(byte);
    if (byte == 0xFF) marked.push_back(0xFF);
  }
  return marked;
}

TEST(SerialMarks, DropsADamagedByteAndStopsThere) {
  SerialMarks marks;
  Bytes into(16);
  const Bytes raw{0x01, 0xFF, 0xFF, 0x02, 0xFF, 0x00, 0x41, 0x03, 0xFF, 0x00, 0x00};
  auto step = marks.decode(raw, into);
  EXPECT_EQ(step.used, 7U);
  EXPECT_EQ(Bytes(into.begin(), into.begin() + 3), (Bytes{0x01, 0xFF, 0x02}));
  EXPECT_EQ(step.made, 3U);
  EXPECT_TRUE(step.damaged);
  step = marks.decode(std::span(raw).subspan(7), into);  // a break looks like a damaged zero
  EXPECT_EQ(step.made, 1U);
  EXPECT_EQ(into[0], 0x03);
  EXPECT_TRUE(step.damaged);
}

TEST(SerialMarks, ADamagedFFIsNotTakenForAnEscape) {
  SerialMarks marks;
  Bytes into(16);
  const Bytes raw{0xFF, 0x00, 0xFF, 0x05};
  EXPECT_TRUE(marks.decode(std::span(raw).first(3), into).damaged);
  const auto step = marks.decode(std::span(raw).subspan(3), into);
  EXPECT_EQ(step.made, 1U);
  EXPECT_EQ(into[0], 0x05);
}

TEST(SerialMarks, DoNotMindWhereTheStreamIsCut) {
  std::mt19937 random(20261121);
  for (int round = 0; round < 300; ++round) {
    Bytes sound, raw;
    std::size_t damaged = 0;
    for (int i = 0; i < 200; ++i) {
      const std::uint8_t byte = random() % 3 == 0 ? static_cast<std::uint8_t>(random() % 2 == 0 ? 0xFF : 0x00)
                                                  : static_cast<std::uint8_t>(random());
      if (random() % 8 == 0) {
        raw.insert(raw.end(), {0xFF, 0x00, byte});
        ++damaged;
      } else {
        sound.push_back(byte);
        const Bytes marked = with_marks({byte});
        raw.insert(raw.end(), marked.begin(), marked.end());
      }
    }
    SerialMarks marks;
    Bytes got;
    std::size_t seen = 0;
    for (std::size_t at = 0; at < raw.size();) {
      Bytes into(1 + random() % 5);
      const auto piece = std::span(raw).subspan(at, std::min<std::size_t>(1 + random() % 7, raw.size() - at));
      const auto step = marks.decode(piece, into);
      got.insert(got.end(), into.begin(), into.begin() + static_cast<std::ptrdiff_t>(step.made));
      seen += step.damaged ? 1U : 0U;
      at += step.used;
    }
    ASSERT_EQ(got, sound) << round;
    ASSERT_EQ(seen, damaged) << round;
  }
}

TEST(SerialLatency, SetsTheTimerWhereItMayAndTellsWhereNot) {
  const birdseye::testing::Scratch scratch;
  const std::string timer = scratch.file("latency_timer", "16\n");
  EXPECT_THAT(lower_latency(-1, timer, 1), HasSubstr("latency timer 1 ms"));
  EXPECT_EQ(birdseye::testing::contents_of(timer), "1\n");
  EXPECT_EQ(lower_latency(-1, scratch / "none", 1), "no low latency mode");
  EXPECT_FALSE(std::filesystem::exists(scratch / "none"));
  // A folder can be written by nobody, not even by root.
  std::filesystem::create_directories(scratch / "closed");
  EXPECT_THAT(lower_latency(-1, scratch / "closed", 1), HasSubstr("stays at"));
}

}  // namespace
}  // namespace birdseye::drivers
