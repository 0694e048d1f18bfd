#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <iostream>
#include <vector>

#include "calibration/time/clock_line.hpp"
#include "tests/calibration/time/simulated_arrivals.hpp"

namespace birdseye {
namespace {

using testing::Jitter;
using testing::SimulatedArrivals;

constexpr Jitter kJitters[] = {Jitter::uniform, Jitter::half_normal, Jitter::exponential, Jitter::bursts};
constexpr double kRates[] = {14, 60, 103.3, 144};

SimulatedArrivals instrument(std::uint64_t seed, Jitter jitter, double rate_hz, double drift_ppm) {
  SimulatedArrivals arrivals(seed);
  arrivals.jitter = jitter;
  // Half-normal to 10 ms and over; of the others 5 ms is the most (uniform) or the mean.
  arrivals.jitter_ms = jitter == Jitter::bursts ? 2 : jitter == Jitter::half_normal ? 3 : 5;
  arrivals.rate_hz = rate_hz;
  arrivals.drift_ppm = drift_ppm;
  return arrivals;
}

ClockLine line_for(const SimulatedArrivals& arrivals) {
  ClockLine::Settings settings;
  settings.period = {arrivals.period_ns()};
  return ClockLine(settings);
}

DeviceTime at(double seconds) {
  return {std::llround(seconds * 1e9)};
}

/// Errors against the sigma they came with.
struct Coverage {
  double count = 0, squares = 0, sigmas = 0, within_1 = 0, within_2 = 0;
  void add(double error, double sigma) {
    ++count;
    squares += error * error;
    sigmas += sigma;
    within_1 += std::abs(error) <= sigma ? 1 : 0;
    within_2 += std::abs(error) <= 2 * sigma ? 1 : 0;
  }
  [[nodiscard]] double rms() const { return std::sqrt(squares / count); }
  [[nodiscard]] double share_1() const { return within_1 / count; }
  [[nodiscard]] double share_2() const { return within_2 / count; }
  [[nodiscard]] std::string text() const {
    char line[160];
    std::snprintf(line, sizeof line, "rms %.4f mean sigma %.4f, %.1f %% within 1, %.1f %% within 2", rms(),
                  sigmas / count, 100 * share_1(), 100 * share_2());
    return line;
  }
};

TEST(ClockLine, IsAsGoodAsItSaysInTheLongRun) {
  Coverage all, drifts;
  for (const Jitter jitter : kJitters) {
    for (const double rate_hz : kRates) {
      Coverage coverage;
      for (std::uint64_t seed = 0; seed < 8; ++seed) {
        SimulatedArrivals arrivals = instrument(100 + seed, jitter, rate_hz, seed % 2 == 0 ? 50 : -50);
        ClockLine line = line_for(arrivals);
        for (int n = 0; n < 45 * rate_hz; ++n) {
          const double true_s = arrivals.measure();
          const auto tick = line.push(at(arrivals.arrival_of(true_s)));
          if (n < 10 * rate_hz || !tick.certain) continue;
          coverage.add((tick.time - at(true_s)).seconds() * 1e3, tick.sigma.seconds() * 1e3);
          all.add((tick.time - at(true_s)).seconds() * 1e3, tick.sigma.seconds() * 1e3);
          drifts.add(line.drift_ppm() - arrivals.drift_ppm, line.drift_sigma_ppm());
        }
      }
      EXPECT_LT(coverage.rms(), 0.12) << name_of(jitter) << " at " << rate_hz << " Hz: " << coverage.text();
    }
  }
  std::cout << "[ figures  ] after 10 s, ms: " << all.text() << "\n[ figures  ] drift, ppm: " << drifts.text() << "\n";
  EXPECT_LT(all.rms(), 0.05);
  EXPECT_GT(all.share_1(), 0.63);
  EXPECT_LT(all.share_1(), 0.75);
  EXPECT_GT(all.share_2(), 0.93);
  EXPECT_GT(drifts.share_1(), 0.63);
  EXPECT_GT(drifts.share_2(), 0.93);
}

TEST(ClockLine, IsAsGoodAsItSaysFromTheTwentiethOn) {
  Coverage all;
  for (const Jitter jitter : kJitters) {
    for (const double rate_hz : kRates) {
      for (std::uint64_t seed = 0; seed < 60; ++seed) {
        SimulatedArrivals arrivals = instrument(1000 + seed, jitter, rate_hz, 0);
        arrivals.drift_ppm = 1000 * arrivals.uniform() - 500;
        ClockLine line = line_for(arrivals);
        for (int n = 0; n < 300; ++n) {
          const double true_s = arrivals.measure();
          const auto tick = line.push(at(arrivals.arrival_of(true_s)));
          if (n < 20 || !tick.certain) continue;
          all.add((tick.time - at(true_s)).seconds() * 1e3, tick.sigma.seconds() * 1e3);
        }
      }
    }
  }
  std::cout << "[ figures  ] records 20 to 300, ms: " << all.text() << "\n";
  EXPECT_LT(all.rms(), 0.25);
  EXPECT_GT(all.share_1(), 0.63);
  EXPECT_LT(all.share_1(), 0.75);
  EXPECT_GT(all.share_2(), 0.93);
}

/// What happens to measurement n: empty where it is lost, else by how much more it is late, s.
using Fate = std::function<std::optional<double>(int)>;

struct Outcome {
  int certain = 0, wrong = 0, doubtful = 0;
  int good_from = -1;  ///< the first certain tick after the last one that was certain and wrong
  double worst_ms = 0;
  std::vector<ClockEvent> events;
};

/// Runs a line over measurements, and counts from the measurement `from` on. `shift_s` is by how much later than they
/// were the line is right to place them.
Outcome run(
    SimulatedArrivals& arrivals, ClockLine& line, int measurements, int from, const Fate& fate,
    const std::function<double(int)>& shift_s = [](int) { return 0.0; }) {
  Outcome outcome;
  for (int n = 0; n < measurements; ++n) {
    const double true_s = arrivals.measure();
    const auto more_s = fate(n);
    if (!more_s) continue;
    const auto tick = line.push(at(arrivals.arrival_of(true_s, *more_s)));
    if (n < from) continue;
    const double error_ms = (tick.time - at(true_s + shift_s(n))).seconds() * 1e3;
    if (!tick.certain) {
      ++outcome.doubtful;
      continue;
    }
    ++outcome.certain;
    outcome.worst_ms = std::max(outcome.worst_ms, std::abs(error_ms));
    // A sigma has a tail: what is wrong by a measurement or a step is wrong by very many.
    if (std::abs(error_ms) > 4 * tick.sigma.seconds() * 1e3 + 0.2) {
      ++outcome.wrong;
      outcome.good_from = -1;
    } else if (outcome.good_from < 0) {
      outcome.good_from = n;
    }
  }
  outcome.events = line.take_events();
  return outcome;
}

TEST(ClockLine, NoCertainTickIsWrongAfterALoss) {
  for (const Jitter jitter : kJitters) {
    for (const double rate_hz : kRates) {
      for (const int lost : {1, 2, 3, 20}) {
        for (std::uint64_t seed = 0; seed < 6; ++seed) {
          SimulatedArrivals arrivals = instrument(seed, jitter, rate_hz, seed % 2 == 0 ? 50 : -500);
          if (jitter == Jitter::exponential) arrivals.jitter_ms = 2;
          ClockLine line = line_for(arrivals);
          const int at_n = static_cast<int>(8 * rate_hz);
          const auto outcome = run(arrivals, line, at_n + static_cast<int>(6 * rate_hz) + lost, at_n, [&](int n) {
            return n >= at_n && n < at_n + lost ? std::nullopt : std::optional<double>(0);
          });
          EXPECT_EQ(outcome.wrong, 0) << name_of(jitter) << " at " << rate_hz << " Hz, " << lost << " lost, seed "
                                      << seed;
          EXPECT_GT(outcome.certain, outcome.doubtful);
          ASSERT_EQ(outcome.events.size(), 1U)
              << name_of(jitter) << " at " << rate_hz << " Hz, " << lost << " lost, " << seed;
          EXPECT_EQ(outcome.events[0].kind, ClockEvent::Kind::slip);
          EXPECT_EQ(outcome.events[0].by_ns, lost * arrivals.period_ns());
        }
      }
    }
  }
}

TEST(ClockLine, RecoversFromAStep) {
  for (const double rate_hz : kRates) {
    for (const double step_ms : {-20.0, -5.0, 5.0, 20.0}) {
      for (std::uint64_t seed = 0; seed < 10; ++seed) {
        SimulatedArrivals arrivals =
            instrument(50 + seed, seed % 2 == 0 ? Jitter::uniform : Jitter::half_normal, rate_hz, 50);
        ClockLine line = line_for(arrivals);
        const int at_n = static_cast<int>(15 * rate_hz);
        const auto more_s = [&](int n) { return n < at_n ? 0.03 : 0.03 + step_ms * 1e-3; };
        const auto outcome = run(
            arrivals, line, at_n + static_cast<int>(15 * rate_hz), at_n,
            [&](int n) { return std::optional(more_s(n)); }, more_s);
        EXPECT_GE(outcome.good_from, 0);
        EXPECT_LE((outcome.good_from - at_n) / rate_hz, 2) << rate_hz << " Hz, " << step_ms << " ms, seed " << seed;
        ASSERT_GE(outcome.events.size(), 1U) << rate_hz << " Hz, " << step_ms << " ms, seed " << seed;
        EXPECT_NEAR(static_cast<double>(outcome.events[0].by_ns) * 1e-6, step_ms, 6) << rate_hz << " Hz";
      }
    }
  }
}

TEST(ClockLine, ABusyMachineDoesNotMoveIt) {
  for (const double rate_hz : kRates) {
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      SimulatedArrivals arrivals = instrument(seed, Jitter::uniform, rate_hz, 50);
      ClockLine line = line_for(arrivals);
      const int at_n = static_cast<int>(12 * rate_hz), burst = static_cast<int>(0.1 * rate_hz) + 1;
      const bool in_one_go = seed % 2 == 0;
      const auto outcome = run(arrivals, line, at_n + static_cast<int>(5 * rate_hz), at_n, [&](int n) {
        if (n < at_n || n >= at_n + burst) return std::optional(0.0);
        // Either nothing comes for a while and then all at once, or all of it comes late.
        return std::optional(in_one_go ? (at_n + burst - n) / rate_hz : 0.05);
      });
      EXPECT_EQ(outcome.wrong, 0) << rate_hz << " Hz, seed " << seed;
      EXPECT_LT(outcome.worst_ms, 0.5) << rate_hz << " Hz, seed " << seed;
      EXPECT_LE(outcome.doubtful, 2 * burst + 3);
      EXPECT_TRUE(outcome.events.empty()) << to_string(outcome.events[0].kind) << rate_hz << " Hz, seed " << seed;
    }
  }
}

TEST(ClockLine, FollowsAChangeOfDrift) {
  for (const double rate_hz : kRates) {
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
      SimulatedArrivals arrivals = instrument(seed, Jitter::uniform, rate_hz, seed % 2 == 0 ? 50 : -50);
      ClockLine line = line_for(arrivals);
      Coverage errors_ms;
      const int at_n = static_cast<int>(40 * rate_hz);
      for (int n = 0; n < 2 * at_n; ++n) {
        if (n == at_n) arrivals.drift_ppm = -arrivals.drift_ppm;
        const double true_s = arrivals.measure();
        const auto tick = line.push(at(arrivals.arrival_of(true_s)));
        if (n > at_n) errors_ms.add((tick.time - at(true_s)).seconds() * 1e3, tick.sigma.seconds() * 1e3);
      }
      EXPECT_LT(errors_ms.rms(), 0.5) << rate_hz << " Hz, seed " << seed;
      EXPECT_LT(std::abs(line.drift_ppm() - arrivals.drift_ppm), 4 * line.drift_sigma_ppm() + 2);
      const auto events = line.take_events();
      ASSERT_EQ(events.size(), 1U) << rate_hz << " Hz, seed " << seed;
      EXPECT_EQ(events[0].kind, ClockEvent::Kind::drift_change);
      EXPECT_NEAR(events[0].by_ppm, 2 * arrivals.drift_ppm, rate_hz < 20 ? 75 : 40) << rate_hz << " Hz, seed " << seed;
    }
  }
}

TEST(ClockLine, ADriftThatNoClockHasIsToldHoweverYoungTheLine) {
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    SimulatedArrivals arrivals = instrument(seed, Jitter::exponential, 103.3, 0);
    ClockLine line = line_for(arrivals);
    const int begins = static_cast<int>(3 * arrivals.rate_hz);
    for (int n = 0; n < 4 * begins; ++n) {
      if (n == begins) arrivals.drift_ppm = 2000;
      line.push(at(arrivals.arrival_of(arrivals.measure())));
    }
    // As a change of drift, or as the steps that it was taken for at first.
    EXPECT_GE(line.take_events().size(), 1U) << seed;
    EXPECT_NEAR(line.drift_ppm(), 2000, 100) << seed;
  }
}

TEST(ClockLine, HoldsForADay) {
  SimulatedArrivals arrivals = instrument(5, Jitter::uniform, 4, 500);
  ClockLine line = line_for(arrivals);
  Coverage late;
  const int day = static_cast<int>(24 * 3600 * arrivals.rate_hz);
  for (int n = 0; n < day; ++n) {
    // The drift wanders with the room's temperature, by a ppm over an hour.
    arrivals.drift_ppm = 500 + std::sin(n / arrivals.rate_hz / 600);
    const double true_s = arrivals.measure();
    const auto tick = line.push(at(arrivals.arrival_of(true_s)));
    if (n > day - 10000) late.add((tick.time - at(true_s)).seconds() * 1e3, tick.sigma.seconds() * 1e3);
  }
  std::cout << "[ figures  ] last 40 minutes of a day, ms: " << late.text() << "\n";
  EXPECT_LT(late.rms(), 0.35);
  EXPECT_GT(late.share_2(), 0.85);  // one run, whose errors hang together
  EXPECT_TRUE(line.take_events().empty());
}

TEST(ClockLine, ANumberLeavesNoDoubt) {
  SimulatedArrivals arrivals = instrument(8, Jitter::exponential, 144, 50);
  ClockLine line = line_for(arrivals);
  for (int n = 0; n < 3000; ++n) {
    const double true_s = arrivals.measure();
    const double arrived_s = arrivals.arrival_of(true_s);
    if (n % 50 > 40) continue;
    const auto tick = line.push_numbered(at(arrived_s), 7000 + n);
    if (n < 100) continue;
    EXPECT_TRUE(tick.certain) << n;
    EXPECT_LT(std::abs((tick.time - at(true_s)).seconds()), 8 * tick.sigma.seconds() + 1e-4) << n;
  }
  EXPECT_TRUE(line.take_events().empty());
  line.push_numbered(at(30), 0);
  EXPECT_EQ(line.take_events().at(0).kind, ClockEvent::Kind::restart);
}

TEST(ClockLine, ANumberFromFarAwayIsAnotherCount) {
  SimulatedArrivals arrivals = instrument(8, Jitter::exponential, 144, 50);
  ClockLine line = line_for(arrivals);
  constexpr std::int64_t kFar = std::int64_t{1} << 52;
  for (int n = 0; n < 1000; ++n) {
    const double arrived_s = arrivals.arrival_of(arrivals.measure());
    line.push_numbered(at(arrived_s), n < 500 ? n : kFar + n);
  }
  const auto events = line.take_events();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].kind, ClockEvent::Kind::restart);
  EXPECT_LT(std::abs(line.drift_ppm()), 500);
}

TEST(ClockLine, LossesThatAreToldAreNoEvent) {
  SimulatedArrivals arrivals = instrument(9, Jitter::uniform, 103.3, -50);
  ClockLine line = line_for(arrivals);
  int lost = 0;
  for (int n = 0; n < 3000; ++n) {
    const double true_s = arrivals.measure();
    const double arrived_s = arrivals.arrival_of(true_s);
    if (n % 100 == 99 || (n > 1000 && n < 1100)) {
      ++lost;
      continue;
    }
    const auto tick = line.push(at(arrived_s), lost);
    lost = 0;
    if (n > 200 && tick.certain) {
      EXPECT_LT(std::abs((tick.time - at(true_s)).seconds()), 8 * tick.sigma.seconds() + 1e-4) << n;
    }
  }
  EXPECT_TRUE(line.take_events().empty());
}

TEST(ClockLine, OneStampTooEarlyIsNotBelieved) {
  SimulatedArrivals arrivals = instrument(10, Jitter::uniform, 103.3, 50);
  ClockLine line = line_for(arrivals);
  const auto outcome = run(
      arrivals, line, 3000, 1000, [](int n) { return std::optional(n == 1500 ? 0.022 : 0.03); },
      [](int) { return 0.03; });
  EXPECT_EQ(outcome.wrong, 0);
  EXPECT_EQ(outcome.doubtful, 1);
  EXPECT_TRUE(outcome.events.empty());
}

TEST(ClockLine, WithoutJitterItIsExact) {
  ClockLine line({.period = {6'944'444}});
  for (std::int64_t n = 0; n < 5000; ++n) {
    const auto tick = line.push({n * 6'944'800});
    if (n <= 20) continue;
    EXPECT_LT(std::abs(tick.time.ns - n * 6'944'800), 3000) << n;
  }
  EXPECT_NEAR(line.drift_ppm(), 51.26, 0.1);
}

}  // namespace
}  // namespace birdseye
