#include "hw-sim/minibird/tracker_script.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "calibration/base/units.hpp"
#include "hw-sim/minibird/motion.hpp"
#include "tests/hw-sim/minibird/unit_bytes.hpp"

namespace birdseye::hw_sim {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::int64_t kStartNs = 1'000'000'000'000;
constexpr std::int64_t kSecondNs = 1'000'000'000;

Fault fault(FaultKind kind, double at_s, std::optional<double> for_s = std::nullopt,
            std::map<std::string, double, std::less<>> values = {}) {
  return {kind, at_s, for_s, std::move(values)};
}

/// Runs a tracker by steps of a millisecond from the start of a stream of matrix records (24 bytes).
class Bench {
 public:
  explicit Bench(TrackerSettings settings = {}, BirdMotion motion = circle_motion({}, kStartNs))
      : script(settings, std::move(motion), kStartNs), now_ns(kStartNs) {}

  void say(const Bytes& bytes) { script.receive(bytes, now_ns); }
  void run(double seconds) {
    const std::int64_t end_ns = now_ns + static_cast<std::int64_t>(seconds * 1e9);
    while (now_ns < end_ns) {
      now_ns += 1'000'000;
      for (Delivery& delivery : script.advance(now_ns)) got.push_back(std::move(delivery));
    }
  }
  [[nodiscard]] Bytes bytes() const {
    Bytes all;
    for (const Delivery& delivery : got) all.insert(all.end(), delivery.bytes.begin(), delivery.bytes.end());
    return all;
  }
  std::vector<Delivery> take() { return std::exchange(got, {}); }

  TrackerScript script;
  std::int64_t now_ns;
  std::vector<Delivery> got;
};

const Bytes kStream{0x5A, 0x46, 0x40};  // position/matrix, run, stream

Eigen::Vector3d position_of(const Bytes& record) {
  constexpr double kMm = 914.4 / 32768;
  return {kMm * signed_word_at(record, 0), kMm * signed_word_at(record, 1), kMm * signed_word_at(record, 2)};
}

/// When a record says that it was measured, s after the start and modulo the circle's 2 s.
double time_told(const Bytes& record) {
  const Eigen::Vector3d from_centre = position_of(record) - Eigen::Vector3d(400, 0, 0);
  const double turns = std::atan2(from_centre.y(), from_centre.x()) / (2 * std::numbers::pi);
  return 2 * (turns - std::floor(turns));
}

/// How much later a record was delivered than it says it was measured, ms.
double latency_ms(const Delivery& delivery) {
  const double at_s = static_cast<double>(delivery.due_ns - kStartNs) * 1e-9;
  const double late = at_s - time_told(delivery.bytes);
  return 1e3 * (late - 2 * std::floor(late / 2));
}

TEST(TrackerScript, RecordsSayWhereTheBirdWasAndComeByTheDelayAndTheWire) {
  Bench bench;
  bench.say(kStream);
  bench.run(5);
  ASSERT_NEAR(static_cast<double>(bench.got.size()), 5 * 103.3, 2);
  for (const Delivery& delivery : bench.got) {
    ASSERT_EQ(delivery.bytes.size(), 24U);
    EXPECT_NEAR((position_of(delivery.bytes) - Eigen::Vector3d(400, 0, 0)).norm(), 200, 0.2);
    // 24 bytes of 10 bits at 115200 baud are 2.083 ms; the position's counts tell the time to 0.2 ms.
    EXPECT_NEAR(latency_ms(delivery), 7.5 + 2.083, 0.4);
    const double turn = std::atan2(signed_word_at(delivery.bytes, 6), signed_word_at(delivery.bytes, 3));  // R21, R11
    EXPECT_NEAR(std::remainder(turn - std::numbers::pi * time_told(delivery.bytes), 2 * std::numbers::pi), 0, 0.002);
  }
}

TEST(TrackerScript, AFlocksRecordsFollowEachOther) {
  TrackerSettings settings;
  settings.unit.birds = 2;
  Bench bench(settings);
  bench.say({0x50, 0x32, 2, 0xF1, 0x5A, 0xF2, 0x5A, 0x50, 0x23, 1, 0x46, 0x40});
  bench.run(0.1);
  ASSERT_FALSE(bench.got.empty());
  for (const Delivery& delivery : bench.got) {
    ASSERT_EQ(delivery.bytes.size(), 50U);
    const Bytes second(delivery.bytes.begin() + 25, delivery.bytes.end());
    const double ahead_s = time_told(second) - time_told(delivery.bytes);
    EXPECT_NEAR(ahead_s - 2 * std::floor(ahead_s / 2), 0.25, 0.002);  // an eighth of a turn of 2 s
  }
}

TEST(TrackerScript, ASlowLineHoldsRecordsBack) {
  TrackerSettings settings;
  settings.baud = 38400;  // 24 bytes take 6.25 ms
  Bench bench(settings);
  bench.say(kStream);
  bench.run(1);
  EXPECT_NEAR(latency_ms(bench.got.back()), 7.5 + 6.25, 0.4);
  Bench overrun([] {
    TrackerSettings slow;
    slow.baud = 19200;  // 80 records a second, of 103
    return slow;
  }());
  overrun.say(kStream);
  overrun.run(1);
  EXPECT_NEAR(static_cast<double>(overrun.got.size()), 79, 2);
}

TEST(TrackerScript, JitterIsNeverEarlyHasItsMeanAndKeepsTheOrder) {
  TrackerSettings settings;
  settings.jitter_ms = 2;
  Bench bench(settings);
  bench.say(kStream);
  bench.run(30);
  double sum = 0, before_ns = 0;
  for (const Delivery& delivery : bench.got) {
    const double late_ms = latency_ms(delivery) - 7.5 - 2.083;
    EXPECT_GT(late_ms, -0.4);
    EXPECT_LT(late_ms, 8.4);
    EXPECT_GE(static_cast<double>(delivery.due_ns), before_ns);
    before_ns = static_cast<double>(delivery.due_ns);
    sum += late_ms;
  }
  EXPECT_NEAR(sum / static_cast<double>(bench.got.size()), 2, 0.15);
}

TEST(TrackerScript, DriftIsInTheRate) {
  TrackerSettings settings;
  settings.drift_ppm = 500;
  Bench bench(settings);
  bench.say(kStream);
  bench.run(20);
  const double spread_s = static_cast<double>(bench.got.back().due_ns - bench.got.front().due_ns) * 1e-9;
  const double rate_hz = static_cast<double>(bench.got.size() - 1) / spread_s;
  EXPECT_NEAR(rate_hz, 103.3 * 1.0005, 1e-5);
  EXPECT_DOUBLE_EQ(bench.script.rate_hz(), 103.3 * 1.0005);
}

TEST(TrackerScript, AlignPutsAMeasurementOnTheInstant) {
  TrackerSettings settings;
  Bench bench(settings, circle_motion({}, kStartNs + kSecondNs));
  bench.script.align(kStartNs + kSecondNs);
  bench.say(kStream);
  bench.run(1.5);
  double nearest_ms = 1e9;
  for (const Delivery& delivery : bench.got) {
    const auto measured_ns = static_cast<double>(delivery.due_ns - kStartNs - kSecondNs) - 7.5e6 - 2.0833e6;
    nearest_ms = std::min(nearest_ms, std::abs(measured_ns) * 1e-6);
  }
  EXPECT_LT(nearest_ms, 1e-3);
}

TEST(TrackerScript, SilentWhileItBootsAndWhileItIsHeldInReset) {
  TrackerSettings settings;
  settings.boot_ms = 500;
  Bench bench(settings);
  bench.say(kStream);  // too early: it hears nothing
  bench.run(0.6);
  EXPECT_TRUE(bench.got.empty());
  bench.say(kStream);
  bench.run(0.1);
  EXPECT_FALSE(bench.take().empty());
  bench.script.set_reset(true, bench.now_ns);
  bench.say(kStream);
  bench.run(1);
  EXPECT_TRUE(bench.got.empty());
  bench.script.set_reset(false, bench.now_ns);
  bench.run(0.45);
  bench.say(kStream);
  bench.run(0.1);
  EXPECT_TRUE(bench.got.empty());
  bench.say({0x4F, 0x00});
  bench.run(0.01);
  EXPECT_EQ(bench.bytes(), (Bytes{0x08, 0xD0}));  // every setting is lost: position/angles, point
}

TEST(TrackerScript, NoiseAndEverythingElseFollowFromTheSeed) {
  const auto bytes = [](std::uint64_t seed) {
    TrackerSettings settings;
    settings.seed = seed;
    settings.noise = {0.5, 0.2};
    settings.jitter_ms = 3;
    settings.faults = {fault(FaultKind::drop_byte, 0.2, 0.5, {{"chance", 0.5}}),
                       fault(FaultKind::line_noise, 0.4, 0.5, {{"chance", 0.5}})};
    Bench bench(settings);
    bench.say(kStream);
    bench.run(1);
    return bench.bytes();
  };
  EXPECT_EQ(bytes(1), bytes(1));
  EXPECT_NE(bytes(1), bytes(2));
}

TEST(FieldDistortion, IsAsLargeAsSaidSmoothAndOfTheSeed) {
  const FieldDistortion field(5, 1);
  double largest = 0;
  for (double x = 100; x <= 700; x += 10) {
    for (double y = -300; y <= 300; y += 10) {
      for (double z = -300; z <= 300; z += 60) {
        const Eigen::Vector3d p(x, y, z);
        const Eigen::Vector3d d = field.displacement_mm(p);
        largest = std::max(largest, d.norm());
        EXPECT_LT((field.displacement_mm(p + Eigen::Vector3d(1, 0, 0)) - d).norm(), 0.1);
      }
    }
  }
  EXPECT_NEAR(largest, 5, 0.1);
  EXPECT_EQ(field.displacement_mm({300, 0, 0}), FieldDistortion(5, 1).displacement_mm({300, 0, 0}));
  EXPECT_NE(field.displacement_mm({300, 0, 0}), FieldDistortion(5, 2).displacement_mm({300, 0, 0}));
  // The rotation is half the curl, here by differences.
  const Eigen::Vector3d p(350, 40, -60);
  Eigen::Matrix3d slope;
  for (int axis = 0; axis < 3; ++axis) {
    slope.col(axis) = (field.displacement_mm(p + 0.01 * Eigen::Vector3d::Unit(axis)) -
                       field.displacement_mm(p - 0.01 * Eigen::Vector3d::Unit(axis))) /
                      0.02;
  }
  const Eigen::Vector3d curl(slope(2, 1) - slope(1, 2), slope(0, 2) - slope(2, 0), slope(1, 0) - slope(0, 1));
  EXPECT_LT((field.rotation_rad(p) - 0.5 * curl).norm(), 1e-8);
}

/// What arrives around a fault from 1 s to 1.5 s into the stream, in three parts.
struct Parts {
  std::vector<Delivery> before, during, after;
  std::vector<FaultEvent> events;
};

Parts parts_of(const Fault& one, TrackerSettings settings = {}, BirdMotion motion = circle_motion({}, kStartNs)) {
  settings.faults = {one};
  Bench bench(settings, std::move(motion));
  bench.say(kStream);
  Parts parts;
  bench.run(1.0);
  parts.before = bench.take();
  bench.run(0.03);  // what was measured before and is still on its way
  bench.take();
  bench.run(0.46);
  parts.during = bench.take();
  bench.run(0.06);
  bench.take();
  bench.run(0.45);
  parts.after = bench.take();
  parts.events = bench.script.take_events();
  return parts;
}

std::size_t phased(const Bytes& bytes) {
  std::size_t count = 0;
  for (const std::uint8_t byte : bytes) count += byte >> 7U;
  return count;
}

bool whole(const Delivery& delivery) {
  return delivery.bytes.size() == 24 && phased(delivery.bytes) == 1 && delivery.bytes[0] >= 0x80;
}

void expect_heals(const Parts& parts) {
  EXPECT_GT(parts.before.size(), 90U);
  for (const Delivery& delivery : parts.before) EXPECT_TRUE(whole(delivery));
  EXPECT_NEAR(static_cast<double>(parts.after.size()), 46, 2);
  for (const Delivery& delivery : parts.after) EXPECT_TRUE(whole(delivery));
  ASSERT_EQ(parts.events.size(), 2U);
  EXPECT_TRUE(parts.events[0].begin);
  EXPECT_EQ(parts.events[0].at_ns, kStartNs + kSecondNs);
  EXPECT_FALSE(parts.events[1].begin);
  EXPECT_EQ(parts.events[1].at_ns, kStartNs + kSecondNs + kSecondNs / 2);
}

TEST(TrackerFaults, ByteFaultsHitTheirShareOfRecordsEachInItsWay) {
  const auto run = [](FaultKind kind) { return parts_of(fault(kind, 1, 0.5, {{"chance", 1}})); };
  const Parts dropped = run(FaultKind::drop_byte);
  expect_heals(dropped);
  for (const Delivery& delivery : dropped.during) EXPECT_EQ(delivery.bytes.size(), 23U);
  const Parts duplicated = run(FaultKind::duplicate_byte);
  expect_heals(duplicated);
  for (const Delivery& delivery : duplicated.during) EXPECT_EQ(delivery.bytes.size(), 25U);
  const Parts flipped = run(FaultKind::wrong_phase_bit);
  expect_heals(flipped);
  for (const Delivery& delivery : flipped.during) {
    EXPECT_EQ(delivery.bytes.size(), 24U);
    EXPECT_NE(phased(delivery.bytes), 1U);
  }
  const Parts noisy = run(FaultKind::line_noise);
  expect_heals(noisy);
  for (const Delivery& delivery : noisy.during) {
    EXPECT_GT(delivery.bytes.size(), 24U);
    EXPECT_TRUE(delivery.line_error);
  }
}

TEST(TrackerFaults, ACorruptByteKeepsTheShapeOfTheRecord) {
  const Parts corrupt = parts_of(fault(FaultKind::corrupt_byte, 1, 0.5, {{"chance", 1}}), {}, still_motion());
  expect_heals(corrupt);
  const Bytes truth = corrupt.before.front().bytes;
  ASSERT_FALSE(corrupt.during.empty());
  for (const Delivery& delivery : corrupt.during) {
    EXPECT_TRUE(whole(delivery));
    int differing = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) differing += delivery.bytes[i] != truth[i] ? 1 : 0;
    EXPECT_EQ(differing, 1);
  }
}

TEST(TrackerFaults, WithoutAnEndAByteFaultHitsOneRecord) {
  TrackerSettings settings;
  settings.faults = {fault(FaultKind::drop_byte, 1, std::nullopt, {{"chance", 0.1}})};
  Bench bench(settings);
  bench.say(kStream);
  bench.run(3);
  std::size_t hit = 0;
  for (const Delivery& delivery : bench.got) hit += whole(delivery) ? 0U : 1U;
  EXPECT_EQ(hit, 1U);
  EXPECT_EQ(bench.script.take_events().size(), 2U);
}

TEST(TrackerFaults, SilenceLosesRecordsAndNothingElse) {
  const Parts stuck = parts_of(fault(FaultKind::stuck_stream, 1, 0.5));
  expect_heals(stuck);
  EXPECT_TRUE(stuck.during.empty());
  const Parts lost = parts_of(fault(FaultKind::lost_record, 1, 0.5, {{"chance", 0.5}}));
  expect_heals(lost);
  EXPECT_NEAR(static_cast<double>(lost.during.size()), 24, 12);
  for (const Delivery& delivery : lost.during) EXPECT_TRUE(whole(delivery));
}

TEST(TrackerFaults, AStuckUnitDoesWhatItHearsAndSaysNothing) {
  TrackerSettings settings;
  settings.faults = {fault(FaultKind::stuck_stream, 0.1, 0.4)};
  Bench bench(settings);
  bench.say(kStream);
  bench.run(0.2);
  bench.take();
  bench.say({0x3F, 0x4F, 0x00});  // stop, and what is your status?
  bench.run(0.5);
  EXPECT_TRUE(bench.got.empty());
  bench.say({0x4F, 0x00});
  bench.run(0.01);
  EXPECT_EQ(bench.bytes(), (Bytes{0x0A, 0xD0}));  // position/matrix, and no stream
}

TEST(TrackerFaults, FrozenRecordsRepeat) {
  TrackerSettings settings;
  settings.noise = {0.5, 0.2};
  const Parts frozen = parts_of(fault(FaultKind::frozen_pose, 1, 0.5), settings);
  expect_heals(frozen);
  ASSERT_GT(frozen.during.size(), 40U);
  for (const Delivery& delivery : frozen.during) EXPECT_EQ(delivery.bytes, frozen.during.front().bytes);
  EXPECT_NE(frozen.after[0].bytes, frozen.after[1].bytes);
}

TEST(TrackerFaults, OrientationGoesAndASaturatedSensorSaysSo) {
  for (const FaultKind kind : {FaultKind::saturated, FaultKind::zero_matrix}) {
    const Parts zero = parts_of(fault(kind, 1, 0.5));
    expect_heals(zero);
    for (const Delivery& delivery : zero.during) {
      for (std::size_t i = 3; i < 12; ++i) EXPECT_EQ(signed_word_at(delivery.bytes, i), 0);
    }
  }
  TrackerSettings settings;
  settings.faults = {fault(FaultKind::saturated, 0.1, 0.2)};
  Bench bench(settings);
  bench.say(kStream);
  bench.run(0.5);
  bench.say({0x3F});
  bench.run(0.1);
  bench.take();
  bench.say({0x4F, 0x0A});
  bench.run(0.01);
  EXPECT_EQ(bench.bytes(), (Bytes{32}));
}

TEST(TrackerFaults, AFlipIsTheOppositeOfThePosition) {
  const Parts flip = parts_of(fault(FaultKind::hemisphere_flip, 1, 0.5), {}, still_motion());
  expect_heals(flip);
  for (const Delivery& delivery : flip.during) {
    EXPECT_LT((position_of(delivery.bytes) + position_of(flip.before.front().bytes)).norm(), 0.2);
    EXPECT_TRUE(std::equal(delivery.bytes.begin() + 6, delivery.bytes.end(), flip.before.front().bytes.begin() + 6));
  }
}

TEST(TrackerFaults, MetalMovesThePositionByNoMoreThanItsPeak) {
  const Parts metal = parts_of(fault(FaultKind::metal_distortion, 1, 0.5, {{"peak_mm", 40}}), {}, still_motion());
  expect_heals(metal);
  const Eigen::Vector3d still(400, 0, 0);
  for (const Delivery& delivery : metal.during) {
    EXPECT_GT((position_of(delivery.bytes) - still).norm(), 1);
    EXPECT_LT((position_of(delivery.bytes) - still).norm(), 41);
  }
  for (const Delivery& delivery : metal.after) EXPECT_LT((position_of(delivery.bytes) - still).norm(), 0.2);
}

TEST(TrackerFaults, ClockAndDriftStep) {
  const Parts late = parts_of(fault(FaultKind::clock_step, 1, 0.5, {{"ms", 25}}));
  expect_heals(late);
  for (const Delivery& delivery : late.before) EXPECT_NEAR(latency_ms(delivery), 9.583, 0.4);
  for (const Delivery& delivery : late.during) EXPECT_NEAR(latency_ms(delivery), 34.583, 0.4);
  for (const Delivery& delivery : late.after) EXPECT_NEAR(latency_ms(delivery), 9.583, 0.4);

  TrackerSettings settings;
  settings.faults = {fault(FaultKind::drift_step, 1, std::nullopt, {{"ppm", 5000}})};
  Bench bench(settings);
  bench.say(kStream);
  bench.run(1.1);
  bench.take();
  bench.run(10);
  const double spread_s = static_cast<double>(bench.got.back().due_ns - bench.got.front().due_ns) * 1e-9;
  EXPECT_NEAR(static_cast<double>(bench.got.size() - 1) / spread_s, 103.3 * 1.005, 1e-4);
}

TEST(TrackerFaults, APowerCycleLosesTheSettingsAndBoots) {
  TrackerSettings settings;
  settings.faults = {fault(FaultKind::power_cycle, 1, 0.5, {{"boot_s", 0.3}})};
  Bench bench(settings);
  bench.say(kStream);
  bench.run(1.02);
  bench.take();
  bench.run(0.7);
  bench.say({0x4F, 0x00});  // it still boots
  bench.run(0.2);
  EXPECT_TRUE(bench.got.empty());
  bench.say({0x4F, 0x00});
  bench.run(0.1);
  EXPECT_EQ(bench.bytes(), (Bytes{0x08, 0xD0}));
}

TEST(TrackerFaults, UnplugIsSaidToTheTransport) {
  TrackerSettings settings;
  settings.faults = {fault(FaultKind::unplug, 0.5, 0.5)};
  Bench bench(settings);
  bench.say(kStream);
  EXPECT_TRUE(bench.script.plugged());
  bench.run(0.7);
  EXPECT_FALSE(bench.script.plugged());
  bench.run(0.5);
  EXPECT_TRUE(bench.script.plugged());
  EXPECT_TRUE(bench.script.streaming());  // only the cable was out
}

}  // namespace
}  // namespace birdseye::hw_sim
