#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "calibration/time/clock_relation.hpp"
#include "calibration/time/discipline.hpp"

namespace birdseye {
namespace {

/// Two machines and a network whose ways there and back take different times, at least the given ones.
struct Network {
  std::mt19937_64 rng;
  double there_ms = 0.2, back_ms = 0.2, queue_ms = 1;
  std::int64_t offset_ns = 77'000'000'000'000;
  double drift_ppm = 30;

  explicit Network(std::uint64_t seed) : rng(seed) {}
  [[nodiscard]] HostTime host_at(double device_s) const {
    return {offset_ns + std::llround(device_s * (1 + drift_ppm * 1e-6) * 1e9)};
  }
  [[nodiscard]] static DeviceTime device_at(double device_s) { return {std::llround(device_s * 1e9)}; }
  ClockExchange exchange(double at_s) {
    std::exponential_distribution<double> queue(1);
    const double received_s = at_s + (there_ms + queue_ms * queue(rng)) * 1e-3;
    const double answered_s = received_s + 2e-4;
    const double back_s = answered_s + (back_ms + queue_ms * queue(rng)) * 1e-3;
    return {host_at(at_s), device_at(received_s), device_at(answered_s), host_at(back_s)};
  }
  [[nodiscard]] double error_ms(const ClockRelation& relation, double at_s) const {
    return (relation.host_from_device(device_at(at_s))->time - host_at(at_s)).seconds() * 1e3;
  }
};

TEST(ClockRelation, IsEmptyUntilKnown) {
  ClockRelation relation;
  EXPECT_FALSE(relation.host_from_device({5}));
  EXPECT_FALSE(relation.device_from_host({5}));
  EXPECT_FALSE(relation.push({{100}, {10}, {20}, {105}})) << "longer at the device than away from the host";
  EXPECT_FALSE(relation.host_from_device({5}));
  EXPECT_TRUE(relation.push({{100}, {10}, {20}, {130}}));
  EXPECT_TRUE(relation.host_from_device({5}));
}

TEST(ClockRelation, SigmaCoversRandomAndLopsidedDelays) {
  double count = 0, within_1 = 0, within_2 = 0, squares = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Network network(seed);
    std::uniform_real_distribution<double> way_ms(0.1, 0.5);
    network.there_ms = way_ms(network.rng);
    network.back_ms = way_ms(network.rng);
    network.drift_ppm = std::normal_distribution<double>(0, 40)(network.rng);
    ClockRelation relation;
    for (int i = 0; i < 100; ++i) {
      EXPECT_TRUE(relation.push(network.exchange(i * 0.5)));
      if (i < 10) continue;
      const double at_s = i * 0.5 + 0.3;
      const double error_ms = std::abs(network.error_ms(relation, at_s));
      const double sigma_ms = relation.host_from_device(Network::device_at(at_s))->sigma.seconds() * 1e3;
      EXPECT_GE(sigma_ms, 0.499e3 * relation.bound().seconds());
      ++count;
      squares += error_ms * error_ms;
      within_1 += error_ms <= sigma_ms ? 1 : 0;
      within_2 += error_ms <= 2 * sigma_ms ? 1 : 0;
    }
  }
  std::printf("[ figures  ] rms %.3f ms, %.1f %% within 1 sigma, %.1f %% within 2\n", std::sqrt(squares / count),
              100 * within_1 / count, 100 * within_2 / count);
  EXPECT_LT(std::sqrt(squares / count), 0.2);
  EXPECT_GT(within_1 / count, 0.68);
  EXPECT_GT(within_2 / count, 0.97);
}

/// Answers pile up in a network that is slow in one direction, and come all at once: each was a little quicker than the
/// one before, and all are slow in the same way. Then it is quick again.
TEST(ClockRelation, TheTruthIsWithinTwoSigmasAlsoWhereOneWayIsSlow) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Network network(seed);
    network.queue_ms = 0.02;
    network.drift_ppm = std::normal_distribution<double>(0, 40)(network.rng);
    const double late_s = std::uniform_real_distribution<double>(0.02, 4)(network.rng), over_s = 7;
    ClockRelation relation;
    for (int i = 0; i < 200; ++i) {
      const double at_s = 0.1 * i;
      network.back_ms = 0.2 + 1e3 * (at_s < over_s ? late_s : std::max(0.0, over_s + late_s - at_s));
      EXPECT_TRUE(relation.push(network.exchange(at_s)));
      const auto related = relation.host_from_device(Network::device_at(at_s));
      const double error_ms = std::abs((related->time - network.host_at(at_s)).seconds()) * 1e3;
      EXPECT_LE(error_ms, 2e3 * related->sigma.seconds() + 1e-3) << seed << ", " << at_s << " s";
    }
    EXPECT_LT(std::abs(network.error_ms(relation, 20)), 0.3) << seed;
  }
}

/// Exchanges that are slow in the same way for long bend the line, whatever was known before.
TEST(ClockRelation, TheTruthIsWithinTwoSigmasAlsoWhereOneWayIsSlowForLong) {
  for (const double drift_ppm : {-80.0, 0.0, 80.0}) {
    for (const double late_ms : {3.0, 30.0, 100.0, 130.0}) {
      for (const bool ramp : {false, true}) {
        Network network(1);
        network.queue_ms = 0.02;
        network.drift_ppm = drift_ppm;
        ClockRelation relation;
        for (int i = 0; i < 1400; ++i) {
          const double at_s = 0.1 * i, since_s = std::max(0.0, at_s - 2);
          network.back_ms = 0.2 + (since_s > 0 ? late_ms * (ramp ? std::min(1.0, since_s / 60) : 1) : 0);
          EXPECT_TRUE(relation.push(network.exchange(at_s)));
          const auto related = relation.host_from_device(Network::device_at(at_s));
          const double error_ms = std::abs((related->time - network.host_at(at_s)).seconds()) * 1e3;
          ASSERT_LE(error_ms, 2e3 * related->sigma.seconds() + 1e-3)
              << drift_ppm << " ppm, " << late_ms << " ms, " << ramp << ", " << at_s << " s";
        }
      }
    }
  }
}

TEST(ClockRelation, ThereAndBackIsTheSame) {
  Network network(3);
  ClockRelation relation;
  for (int i = 0; i < 50; ++i) relation.push(network.exchange(i));
  for (const double at_s : {0.0, 20.0, 49.5, 60.0}) {
    const DeviceTime device = Network::device_at(at_s);
    EXPECT_LE(std::abs((relation.device_from_host(relation.host_from_device(device)->time)->time - device).ns), 1);
  }
  EXPECT_NEAR(relation.drift_ppm(), network.drift_ppm, 4 * relation.drift_sigma_ppm() + 1);
  EXPECT_GT(relation.host_from_device(Network::device_at(2000))->sigma,
            relation.host_from_device(Network::device_at(49))->sigma);
}

TEST(ClockRelation, AStepIsSeenAndOneBadStampIsNot) {
  Network network(4);
  ClockRelation relation;
  for (int i = 0; i < 40; ++i) {
    auto exchange = network.exchange(i * 0.5);
    if (i == 20) {
      exchange.device_received.ns += 80'000'000;
      exchange.device_sent.ns += 80'000'000;
    }
    relation.push(exchange);
  }
  EXPECT_TRUE(relation.take_events().empty());
  EXPECT_LT(std::abs(network.error_ms(relation, 20)), 0.5);
  network.offset_ns += 50'000'000;
  for (int i = 40; i < 44; ++i) relation.push(network.exchange(i * 0.5));
  const auto events = relation.take_events();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_NEAR(static_cast<double>(events[0].by_ns) * 1e-6, 50, 3);
  EXPECT_LT(std::abs(network.error_ms(relation, 22)), 2);
}

TEST(ClockChoice, TakesTheSmallerHonestSigma) {
  const ClockDiscipline ptp{true, {20'000}, {1'000}, true, "ptp"}, ntp{true, {40'000'000}, {900'000}, false, "ntp"};
  const ClockDiscipline alone{false, {16'000'000'000}, {16'000'000'000}, false, "none"};
  EXPECT_FALSE(choose_clock(std::nullopt, ptp, alone));
  EXPECT_EQ(choose_clock(std::nullopt, ptp, ptp)->way, ClockChoice::Way::common_clock);
  EXPECT_EQ(choose_clock(Duration{100'000}, ptp, ptp)->way, ClockChoice::Way::common_clock);
  EXPECT_EQ(choose_clock(Duration{100'000}, ptp, ptp)->sigma.ns, 2828);
  EXPECT_EQ(choose_clock(Duration{100'000}, ptp, ntp)->way, ClockChoice::Way::exchange);
  EXPECT_EQ(choose_clock(Duration{100'000}, ptp, alone)->way, ClockChoice::Way::exchange);
  // A bound without an estimate is not an error of nothing.
  EXPECT_GT(common_clock_sigma({true, {1'000'000}, {0}, false, ""}, ptp)->ns, 500'000);
}

}  // namespace
}  // namespace birdseye
