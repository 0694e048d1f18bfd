#include "drivers/minibird/assembler.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <span>

#include "calibration/geometry/transform.hpp"
#include "tests/drivers/minibird/wire_records.hpp"

namespace birdseye::drivers::minibird {
namespace {

using birdseye::testing::Wire;
using birdseye::testing::wire_record;
using Eigen::Vector3d;

StreamLayout layout(std::size_t birds) {
  StreamLayout layout;
  layout.birds.assign(birds, BirdLayout{});
  layout.group_mode = birds > 1;
  layout.rate_hz = 144;
  return layout;
}

std::vector<Measurement> assemble(MeasurementAssembler& assembler, const std::vector<Chunk>& chunks) {
  std::vector<Measurement> all;
  for (const Chunk& chunk : chunks) {
    for (Measurement& m : assembler.push(chunk)) all.push_back(std::move(m));
  }
  return all;
}

/// Where bird 1 is in a cycle: the number can be read off it.
Vector3d numbered(int cycle) {
  return {250 + 0.5 * cycle, 40, -30};
}
int number_of(const RecordPose& pose) {
  return static_cast<int>(std::lround((pose.position_mm->x() - 250) / 0.5));
}

/// One by one: g++ 12 takes a range for one that it is not.
void append(Bytes& to, std::span<const std::uint8_t> more) {
  for (const std::uint8_t byte : more) to.push_back(byte);
}

Bytes with_address(Bytes record, std::uint8_t address) {
  record.push_back(address);
  return record;
}

/// Two birds, both turning as they go.
Bytes both(int cycle) {
  const Eigen::Matrix3d turn = rotation_exp(Vector3d(0.1, 0.2, 0.01 * cycle));
  Bytes bytes = with_address(wire_record(numbered(cycle), turn), 1);
  const Bytes second = with_address(wire_record(Vector3d(200, -100, 0.3 * cycle), turn.transpose()), 2);
  append(bytes, second);
  return bytes;
}

TEST(Assembler, AnyCutGivesTheSameMeasurementsAtTheSameTimes) {
  Wire wire;
  constexpr int kCycles = 600;
  for (int cycle = 0; cycle < kCycles; ++cycle) wire.send(cycle, both(cycle));
  for (unsigned seed = 0; seed < 12; ++seed) {
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> length(1, seed < 6 ? 7 : 260);
    MeasurementAssembler assembler(layout(2));
    const auto all = assemble(assembler, wire.cut([&] { return length(random); }, [] { return 0; }));
    ASSERT_EQ(all.size(), std::size_t{kCycles}) << seed;
    for (int cycle = 3; cycle < kCycles; ++cycle) {  // by then records have differed
      const Measurement& m = all[static_cast<std::size_t>(cycle)];
      ASSERT_TRUE(m.birds[0].pose && m.birds[1].pose) << cycle << " " << m.birds[0].doubt << m.birds[1].doubt;
      EXPECT_EQ(number_of(*m.birds[0].pose), cycle);
      // A chunk may hold up to five cycles: what came first is then known late, until the line has seen a short one.
      if (seed < 6) {
        EXPECT_LT(std::abs(m.acquired.ns - wire.start_of(cycle)), 100'000) << cycle;
      }
    }
    const MiniBirdCounters counters = assembler.counters();
    EXPECT_EQ(counters.measurements, std::uint64_t{kCycles});
    EXPECT_EQ(counters.lost_measurements + counters.phase_errors + counters.discarded_bytes, 0U);
    EXPECT_EQ(counters.of(DoubtKind::unconfirmed), 2U * 3);
    EXPECT_EQ(counters.of(DoubtKind::none), 2 * (kCycles - 3U));
  }
}

TEST(Assembler, TenMinutesAtTheHighestRateLoseNothing) {
  MeasurementAssembler assembler(layout(2));
  constexpr int kCycles = 144 * 600;
  std::mt19937 random(3);
  std::exponential_distribution<double> late_ns(1 / 1e6);
  std::uint64_t got = 0;
  std::int64_t worst_ns = 0;
  Wire clock;
  for (int cycle = 0; cycle < kCycles; ++cycle) {
    Wire wire;
    wire.send(cycle, both(cycle % 400));
    for (const Chunk& chunk : wire.cut([] { return 62; }, [&] { return std::min(late_ns(random), 4e6); })) {
      for (const Measurement& m : assembler.push(chunk)) {
        ++got;
        if (cycle > 400) worst_ns = std::max(worst_ns, std::abs(m.acquired.ns - clock.start_of(cycle)));
      }
    }
  }
  EXPECT_EQ(got, std::uint64_t{kCycles});
  EXPECT_EQ(assembler.counters().lost_measurements, 0U);
  EXPECT_LT(worst_ns, 1'000'000);
}

TEST(Assembler, ALostRecordNeverShiftsTimesUnsaid) {
  int certain = 0, uncertain = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> chance(0, 1);
    std::exponential_distribution<double> late_ns(1 / 1.5e6);
    Wire wire;
    int lost = 0;
    constexpr int kCycles = 1500;
    for (int cycle = 0; cycle < kCycles; ++cycle) {
      Bytes bytes = wire_record(numbered(cycle));
      const double dice = chance(random);
      if (dice < 0.01 && cycle > 300) {  // a part of a record, or the whole of it
        const auto from = static_cast<std::ptrdiff_t>(random() % bytes.size());
        const auto to = dice < 0.003 ? static_cast<std::ptrdiff_t>(bytes.size()) : from + 1;
        bytes.erase(dice < 0.003 ? bytes.begin() : bytes.begin() + from, bytes.begin() + to);
        ++lost;
      }
      wire.send(cycle, bytes);
    }
    MeasurementAssembler assembler(layout(1));
    for (const Measurement& m :
         assemble(assembler, wire.cut([&] { return 1 + random() % 40; }, [&] { return late_ns(random); }))) {
      // The line needs some arrivals to know what is early.
      if (!m.birds[0].pose || number_of(*m.birds[0].pose) < 100) continue;
      const double off_ns = static_cast<double>(std::abs(m.acquired.ns - wire.start_of(number_of(*m.birds[0].pose))));
      ++(m.time_certain ? certain : uncertain);
      if (m.time_certain) {
        EXPECT_LT(off_ns, 0.2e6 + 4 * static_cast<double>(m.acquired_sigma.ns)) << seed;
      } else {
        EXPECT_LT(off_ns, 1.5e6 + 1.2 * static_cast<double>(m.acquired_sigma.ns)) << seed;
      }
    }
    EXPECT_NEAR(static_cast<double>(assembler.counters().lost_measurements), lost, 1) << seed;
    EXPECT_GT(lost, 4);
  }
  // What is late by about a period is in doubt, and here cuts alone make some that late.
  EXPECT_GT(certain, 8 * uncertain);
}

TEST(Assembler, RandomDamageNeverCrashesAndNeverYieldsAWildPose) {
  std::uint64_t published = 0, cycles = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> chance(0, 1);
    Wire wire;
    const auto truth = [&](double s) {
      return Vector3d(400 + 150 * std::cos(3 * s), 150 * std::sin(3 * s), 100 * std::sin(2 * s));
    };
    const auto turn = [](double s) { return rotation_exp(Vector3d(0.3, std::sin(s), 2 * s)); };
    for (int cycle = 0; cycle < 800; ++cycle) {
      const double s = cycle / wire.rate_hz;
      Bytes bytes = wire_record(truth(s), turn(s));
      ++cycles;
      if (chance(random) < 0.05) {
        std::uint8_t& byte = bytes[random() % bytes.size()];
        byte = static_cast<std::uint8_t>(seed % 2 == 0 ? byte ^ (1U << random() % 8U) : random());
      }
      if (chance(random) < 0.01) bytes.insert(bytes.begin() + random() % 24, static_cast<std::uint8_t>(random()));
      wire.send(cycle, bytes);
    }
    MeasurementAssembler assembler(layout(1));
    for (const Measurement& m : assemble(assembler, wire.cut([&] { return 1 + random() % 60; }, [] { return 0; }))) {
      const auto& pose = m.birds[0].pose;
      if (!pose) continue;
      ++published;
      // What a damaged byte can hide behind: the slack, the noise that damage itself feigns, and the acceleration
      // limit.
      double least_mm = 1e9, least_rad = 1e9;
      for (int step = -100; step <= 100; ++step) {
        const double s = static_cast<double>(m.acquired.ns) * 1e-9 + step * 0.0005;
        least_mm = std::min(least_mm, (*pose->position_mm - truth(s)).norm());
        least_rad = std::min(least_rad, rotation_angle_between(*pose->rotation, turn(s)));
      }
      EXPECT_LT(least_mm, 4 + 2000 / 144.0) << seed;
      EXPECT_LT(least_rad, 0.02) << seed;
    }
  }
  // And it is not by refusing everything.
  EXPECT_GT(published, cycles * 85 / 100);
}

TEST(Assembler, T10GroupAndButtonMode) {
  StreamLayout two = layout(2);
  for (BirdLayout& bird : two.birds) bird.format = RecordFormat::position_angles;
  two.button_byte = true;
  two.plausibility.start_confirms = 0;
  two.plausibility.frozen_after = 0;  // its first record is judged
  MeasurementAssembler assembler(two);
  const Chunk chunk{{0xE3, 0x11, 0x55, 0x76, 0x2A, 0x05, 0x00, 0x10, 0x2A, 0x75, 0x00, 0x20, 0x10, 0x01,
                     0xE3, 0x71, 0x1C, 0x16, 0x47, 0x23, 0x2A, 0x55, 0x2A, 0x05, 0x1C, 0x7E, 0x00, 0x02},
                    {1'000'000'000}};
  const auto all = assembler.push(chunk);
  ASSERT_EQ(all.size(), 1U);
  ASSERT_TRUE(all[0].birds[0].pose);
  EXPECT_EQ(all[0].birds[0].button, 0x10);
  EXPECT_LT((*all[0].birds[0].pose->position_mm - Vector3d(253.9380, -133.3872, 76.1256)).norm(), 2e-3);
  // The second is behind the transmitter, where a unit set to the forward half-space never reports.
  EXPECT_EQ(all[0].birds[1].kind, DoubtKind::outside_hemisphere);
}

TEST(Assembler, BirdsOfDifferentFormats) {
  StreamLayout two = layout(2);
  two.birds[1].format = RecordFormat::position;
  two.plausibility.start_confirms = 0;
  two.plausibility.frozen_after = 0;  // its first record is judged
  Wire wire;
  for (int cycle = 0; cycle < 50; ++cycle) {
    Bytes bytes = with_address(wire_record(numbered(cycle)), 1);
    const Bytes second = with_address(wire_record(std::vector<int>{8000 + 16 * cycle, 4000, 400}), 2);
    append(bytes, second);
    wire.send(cycle, bytes);
  }
  MeasurementAssembler assembler(two);
  const auto all = assemble(assembler, wire.cut([] { return 11; }, [] { return 0; }));
  ASSERT_EQ(all.size(), 50U);
  for (const Measurement& m : all) {
    ASSERT_TRUE(m.birds[0].pose && m.birds[1].pose) << m.birds[0].doubt << m.birds[1].doubt;
    EXPECT_FALSE(m.birds[1].pose->rotation);
  }
}

StreamLayout angles_alone() {
  StreamLayout one = layout(1);
  one.birds[0].format = RecordFormat::position_angles;
  one.plausibility.start_confirms = 0;
  one.plausibility.frozen_after = 0;  // its first record is judged
  return one;
}

TEST(Assembler, U7NothingOfWhatSurroundsALineErrorIsTaken) {
  MeasurementAssembler assembler(angles_alone());
  const Bytes good{0xE3, 0x11, 0x55, 0x76, 0x2A, 0x05, 0x00, 0x10, 0x2A, 0x75, 0x00, 0x20};
  Chunk chunk{good, {1'000'000'000}};
  append(chunk.bytes, std::span(good).first(5));
  EXPECT_EQ(assembler.push(chunk).size(), 1U);
  // The line has dropped what it knew to be damaged; here is the rest of some record, and a whole one.
  Chunk after{{0x00, 0x2A, 0x05, 0x00, 0x10, 0x58, 0x75}, {1'020'000'000}, true};
  append(after.bytes, good);
  const auto all = assembler.push(after);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_TRUE(all[0].birds[0].pose) << all[0].birds[0].doubt;
  EXPECT_EQ(assembler.counters().line_errors, 1U);
  EXPECT_EQ(assembler.counters().discarded_bytes, 12U);
}

TEST(Assembler, U5StatusBytesTakenForDataAreDoubted) {
  // Five good records, and a sixth of full length that is garbage: two bytes too many in it.
  const Bytes bytes{0xE3, 0x11, 0x55, 0x76, 0x2A, 0x05, 0x00, 0x10, 0x2A, 0x75, 0x00, 0x20, 0xD5, 0x12, 0x55,
                    0x76, 0x2A, 0x05, 0x00, 0x10, 0x58, 0x75, 0x00, 0x20, 0xC7, 0x13, 0x55, 0x76, 0x2A, 0x05,
                    0x00, 0x10, 0x05, 0x76, 0x00, 0x20, 0xB9, 0x14, 0x55, 0x76, 0x2A, 0x05, 0x00, 0x10, 0x33,
                    0x76, 0x00, 0x20, 0xAA, 0x15, 0x55, 0x76, 0x2A, 0x05, 0x00, 0x10, 0x60, 0x76, 0x00, 0x20,
                    0x9C, 0x16, 0x31, 0x60, 0x55, 0x76, 0x2A, 0x05, 0x00, 0x10, 0x0E, 0x77, 0x00, 0x20};
  Wire wire;
  for (std::size_t i = 0; i < 6; ++i) {
    const std::size_t end = i == 5 ? bytes.size() : 12 * i + 12;
    wire.send(static_cast<int>(i), Bytes(bytes.begin() + static_cast<std::ptrdiff_t>(12 * i),
                                         bytes.begin() + static_cast<std::ptrdiff_t>(end)));
  }
  StreamLayout one = angles_alone();
  one.plausibility.most_speed_mm_s = 4000;  // half an inch from record to record is how the vector was made
  MeasurementAssembler assembler(one);
  const auto all = assemble(assembler, wire.cut([] { return 12; }, [] { return 0; }));
  ASSERT_EQ(all.size(), 6U);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_TRUE(all[i].birds[0].pose) << i << all[i].birds[0].doubt;
  EXPECT_FALSE(all[5].birds[0].pose);
  EXPECT_EQ(assembler.counters().phase_errors, 1U);
}

TEST(Assembler, AfterARestartTheClockBeginsAnew) {
  MeasurementAssembler assembler(layout(1));
  Wire wire;
  for (int cycle = 0; cycle < 300; ++cycle) wire.send(cycle, wire_record(numbered(cycle)));
  (void)assemble(assembler, wire.cut([] { return 24; }, [] { return 0; }));
  // Half a second later, and at other times than the rhythm until then.
  Wire again;
  for (int cycle = 0; cycle < 50; ++cycle) again.send(cycle, wire_record(numbered(cycle)));
  auto chunks = again.cut([] { return 24; }, [] { return 0; });
  const std::int64_t start = 3'000'000'000 + 3'456'789;
  for (Chunk& chunk : chunks) chunk.arrived.ns += start;
  chunks.front().after_restart = true;
  const auto all = assemble(assembler, chunks);
  ASSERT_EQ(all.size(), 50U);
  for (int cycle = 0; cycle < 50; ++cycle) {
    EXPECT_LT(std::abs(all[static_cast<std::size_t>(cycle)].acquired.ns - start - again.start_of(cycle)), 20'000);
  }
  EXPECT_EQ(assembler.counters().lost_measurements, 0U);
  EXPECT_EQ(assembler.counters().restarts, 1U);
}

TEST(Assembler, ABirdWhoseRecordIsLostIsNamedAndTheOtherStays) {
  Wire wire;
  for (int cycle = 0; cycle < 40; ++cycle) {
    Bytes bytes = both(cycle);
    if (cycle == 20) bytes.erase(bytes.begin() + 7);
    wire.send(cycle, bytes);
  }
  MeasurementAssembler assembler(layout(2));
  const auto all = assemble(assembler, wire.cut([] { return 25; }, [] { return 0; }));
  ASSERT_EQ(all.size(), 40U);
  EXPECT_EQ(all[20].birds[0].kind, DoubtKind::lost);
  EXPECT_EQ(all[20].birds[0].doubt, "its record was lost");
  EXPECT_TRUE(all[20].birds[1].pose);
  EXPECT_LT(std::abs(all[20].acquired.ns - wire.start_of(20)), 100'000);
  EXPECT_EQ(assembler.counters().lost_measurements, 0U);
}

}  // namespace
}  // namespace birdseye::drivers::minibird
