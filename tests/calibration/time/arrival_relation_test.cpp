#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "calibration/time/arrival_relation.hpp"

namespace birdseye {
namespace {

constexpr std::int64_t kEpochNs = 1'790'000'000'000'000'000;  // a server's stamps: seconds since 1970

/// A server that stamps by its own clock, and a network that takes at least least_ms.
struct Server {
  std::mt19937_64 rng{7};
  double least_ms = 3, queue_ms = 6, drift_ppm = 40;
  std::int64_t moved_ns = 0;

  [[nodiscard]] DeviceTime stamp_at(double host_s) const {
    return {kEpochNs + moved_ns + std::llround(host_s * (1 + drift_ppm * 1e-6) * 1e9)};
  }
  [[nodiscard]] static HostTime host_at(double host_s) { return {std::llround(host_s * 1e9)}; }
  std::optional<ClockEvent> send(ArrivalRelation& relation, double host_s) {
    std::exponential_distribution<double> queue(1);
    return relation.push(stamp_at(host_s), host_at(host_s + (least_ms + queue_ms * queue(rng)) * 1e-3));
  }
  [[nodiscard]] double error_ms(const ArrivalRelation& relation, double host_s) const {
    return (relation.host_from_device(stamp_at(host_s))->time - host_at(host_s)).seconds() * 1e3;
  }
};

TEST(ArrivalRelation, IsEmptyUntilSomethingArrived) {
  ArrivalRelation relation;
  EXPECT_FALSE(relation.host_from_device({5}));
  EXPECT_FALSE(relation.device_from_host({5}));
}

TEST(ArrivalRelation, TakesWhatComesForOlderAndNeverForNewer) {
  Server server;
  ArrivalRelation relation;
  for (int i = 0; i < 1500; ++i) {
    const double at_s = i * 0.04;
    EXPECT_FALSE(server.send(relation, at_s));
    const double error_ms = server.error_ms(relation, at_s);
    const double sigma_ms = relation.host_from_device(server.stamp_at(at_s))->sigma.seconds() * 1e3;
    EXPECT_GE(sigma_ms, 20) << "nothing tells what the fastest way takes";
    EXPECT_LT(std::abs(error_ms), sigma_ms) << at_s;
    // The edge is 3 ms late, and 20 ms are taken off; what the drift does in 60 s, 2.4 ms, must not add up.
    if (i > 250) {
      EXPECT_NEAR(error_ms, 3 - 20, 1.0) << at_s;
      EXPECT_NEAR((*relation.device_from_host(Server::host_at(at_s)) - server.stamp_at(at_s)).seconds() * 1e3, 17, 2);
    }
  }
}

TEST(ArrivalRelation, AHaltOfTheNetworkIsNoStep) {
  Server server;
  ArrivalRelation relation;
  for (int i = 0; i < 500; ++i) EXPECT_FALSE(server.send(relation, i * 0.04));
  for (int i = 0; i < 50; ++i)
    EXPECT_FALSE(relation.push(server.stamp_at(20 + i * 0.04), Server::host_at(22 + i * 0.001)));
  EXPECT_NEAR(server.error_ms(relation, 22), 3 - 20, 1.0);
}

/// Buffers that fill on the way make everything late, for good: it is never taken for new.
TEST(ArrivalRelation, ANetworkThatGrowsSlowerIsNotFollowed) {
  for (const double to_ms : {300.0, 900.0}) {
    Server server;
    ArrivalRelation relation;
    for (int i = 0; i < 500; ++i) EXPECT_FALSE(server.send(relation, i * 0.04));
    EXPECT_FALSE(relation.behind());
    for (int i = 500; i < 3500; ++i) {
      server.least_ms = std::min(to_ms, 3 + (i - 500) * 0.5);
      EXPECT_FALSE(server.send(relation, i * 0.04)) << i;
    }
    EXPECT_LT(server.error_ms(relation, 140), 0) << "never for newer than it is";
    EXPECT_GT(server.error_ms(relation, 140), -25) << "what is never seen, and some drift";
    EXPECT_EQ(relation.behind().has_value(), to_ms > 500);
    if (relation.behind()) {
      EXPECT_NEAR(relation.behind()->seconds(), 0.9, 0.1);
    }
    for (int i = 3500; i < 3600; ++i) {
      server.least_ms = 3;
      (void)server.send(relation, i * 0.04);
    }
    EXPECT_FALSE(relation.behind()) << "it is fast again";
  }
}

TEST(ArrivalRelation, AClockThatIsMovedIsToldAndFollowed) {
  for (const double by_s : {-5.0, 5.0}) {
    Server server;
    ArrivalRelation relation;
    for (int i = 0; i < 500; ++i) EXPECT_FALSE(server.send(relation, i * 0.04));
    server.moved_ns = std::llround(by_s * 1e9);
    std::optional<ClockEvent> told;
    for (int i = 500; i < 700; ++i) {
      const auto event = server.send(relation, i * 0.04);
      EXPECT_FALSE(told && event) << "told twice";
      if (event) told = event;
    }
    ASSERT_TRUE(told) << by_s;
    EXPECT_EQ(told->kind, ClockEvent::Kind::step);
    EXPECT_NEAR(static_cast<double>(told->by_ns) * 1e-9, -by_s, 0.1);
    EXPECT_NEAR(server.error_ms(relation, 28), 3 - 20, 3.0);
  }
}

}  // namespace
}  // namespace birdseye
