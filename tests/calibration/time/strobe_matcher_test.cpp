#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <random>

#include "calibration/time/strobe_matcher.hpp"

namespace birdseye {
namespace {

constexpr std::int64_t kPeriod = 16'666'667;

StrobeMatcher::Settings narrow() {
  StrobeMatcher::Settings settings;
  settings.period = {kPeriod};
  settings.exposure = Duration::from_ms(8);
  settings.least_delay = Duration::from_ms(18);
  settings.most_delay = Duration::from_ms(32);
  return settings;
}

StrobeMatcher::Settings wide() {
  auto settings = narrow();
  settings.least_delay = Duration{0};
  settings.most_delay = Duration::from_ms(100);
  return settings;
}

/// A camera whose frames come 25 ms after their exposure began, and up to 2 ms later still.
struct Camera {
  std::mt19937_64 rng{7};
  std::int64_t delay = 25'000'000;
  std::function<bool(int)> exposes = [](int) { return true; }, edge_seen = exposes, delivers = exposes;
  std::function<std::optional<std::int64_t>(int)> spurious_after = [](int) { return std::nullopt; };
  int paired = 0, wrong = 0;

  static std::int64_t begin(int n) { return 1'000'000'000 + n * kPeriod; }
  /// Frames are pushed when they come, after the edges until then. Counts what was paired, and paired wrongly.
  void film(StrobeMatcher& matcher, int frames, int first = 0) {
    std::map<std::int64_t, std::function<void()>> events;
    std::uniform_int_distribution<std::int64_t> late(0, 2'000'000);
    int number = first;
    for (int n = first; n < first + frames; ++n) {
      if (!exposes(n)) continue;
      const std::int64_t start = begin(n);
      if (edge_seen(n)) events[start] = [&matcher, start] { matcher.push_edge({start}); };
      if (const auto after = spurious_after(n)) {
        const std::int64_t extra = start + *after;
        events[extra] = [&matcher, extra] { matcher.push_edge({extra}); };
      }
      const int counted = number++;
      if (!delivers(n)) continue;
      const std::int64_t stamp = start + delay + late(rng);
      events[stamp] = [this, &matcher, stamp, start, counted] {
        const auto match = matcher.match({stamp}, counted);
        if (!match.acquired) {
          EXPECT_FALSE(match.reason.empty());
          return;
        }
        ++paired;
        wrong += match.acquired->ns == start + 4'000'000 ? 0 : 1;
      };
    }
    for (const auto& [time, happen] : events) happen();
  }
};

TEST(StrobeMatcher, PairsEveryFrameWithTheMiddleOfItsExposure) {
  StrobeMatcher matcher(narrow());
  Camera camera;
  camera.film(matcher, 300);
  EXPECT_EQ(camera.wrong, 0);
  EXPECT_GE(camera.paired, 285);
  EXPECT_NEAR(static_cast<double>(matcher.delay()->ns) * 1e-6, 26, 1);
}

TEST(StrobeMatcher, LostEdgesAndFramesAndSpuriousEdgesPairNothingWrongly) {
  StrobeMatcher matcher(narrow());
  Camera camera;
  camera.edge_seen = [](int n) { return n % 37 != 5; };
  camera.delivers = [](int n) { return n % 23 != 11 && (n < 100 || n > 108); };
  camera.spurious_after = [](int n) { return n % 41 == 17 ? std::optional<std::int64_t>(3'000'000) : std::nullopt; };
  camera.film(matcher, 600);
  EXPECT_EQ(camera.wrong, 0);
  EXPECT_GT(camera.paired, 500);
  EXPECT_EQ(matcher.spurious_edges(), 15U);
}

TEST(StrobeMatcher, DoesNotGuessBetweenDelaysAPeriodApart) {
  StrobeMatcher matcher(wide());
  Camera camera;
  // The stream was on before the strobe was watched: nothing distinguishes one period from the next.
  camera.edge_seen = [](int n) { return n > 20; };
  camera.delivers = [](int n) { return n > 40; };
  camera.film(matcher, 200);
  EXPECT_EQ(camera.paired, 0);
  EXPECT_FALSE(matcher.delay());
  EXPECT_NE(matcher.match({Camera::begin(201) + 25'000'000}, 201).reason.find("differ by a period"), std::string::npos);
}

TEST(StrobeMatcher, ExposuresThatWereLeftOutTellTheDelay) {
  StrobeMatcher matcher(wide());
  Camera camera;
  camera.edge_seen = [](int n) { return n > 20; };
  camera.delivers = [](int n) { return n > 40; };
  camera.exposes = [](int n) { return n % 50 != 49 && n % 50 != 29; };
  camera.film(matcher, 300);
  EXPECT_EQ(camera.wrong, 0);
  EXPECT_GT(camera.paired, 50);
}

TEST(StrobeMatcher, StampsMayLieBeforeTheExposure) {
  auto settings = narrow();
  settings.least_delay = Duration::from_ms(-7);
  settings.most_delay = Duration::from_ms(7);
  StrobeMatcher matcher(settings);
  int paired = 0;
  for (int n = 0; n < 100; ++n) {
    matcher.push_edge({Camera::begin(n)});
    const auto match = matcher.match({Camera::begin(n) - 3'000'000}, n);
    if (!match.acquired) continue;
    ++paired;
    EXPECT_EQ(match.acquired->ns, Camera::begin(n) + 4'000'000);
  }
  EXPECT_GT(paired, 80);
}

TEST(StrobeMatcher, ADelayThatChangesByAPeriodIsSaid) {
  StrobeMatcher matcher(narrow());
  Camera camera;
  camera.film(matcher, 100);
  EXPECT_TRUE(matcher.delay());
  // The edge where this frame's is expected is not the one that its number says.
  for (int n = 100; n < 103; ++n) matcher.push_edge({Camera::begin(n)});
  const auto match = matcher.match({Camera::begin(100) + kPeriod + camera.delay}, 100);
  EXPECT_FALSE(match.acquired);
  EXPECT_NE(match.reason.find("counted differently"), std::string::npos);
  EXPECT_FALSE(matcher.delay());
}

TEST(StrobeMatcher, ADelayThatChangesAcrossAGapIsNotLearntFromItsBoundsAlone) {
  // By a period, by more and by less: what the bounds leave is then another delay, or the right one by chance.
  for (const std::int64_t change : {kPeriod, kPeriod - 2'000'000, kPeriod / 2 + 1'500'000, -kPeriod + 1'000'000}) {
    for (const bool delivered : {true, false}) {
      StrobeMatcher matcher(narrow());
      Camera camera;
      camera.film(matcher, 100);
      ASSERT_EQ(camera.wrong, 0);
      ASSERT_GT(camera.paired, 80);
      camera.delay += change;
      camera.delivers = [&](int n) { return delivered || n > 130; };
      camera.film(matcher, 300, 100);
      EXPECT_EQ(camera.wrong, 0) << change;
    }
  }
}

TEST(StrobeMatcher, ADelayThatHasChangedIsLearntFromExposuresThatWereLeftOut) {
  StrobeMatcher matcher(wide());
  Camera camera;
  camera.exposes = [](int n) { return n % 50 != 49 && n % 50 != 29; };
  camera.film(matcher, 200);
  const int until_then = camera.paired;
  EXPECT_GT(until_then, 40);
  camera.delay += kPeriod;
  camera.film(matcher, 300, 200);
  EXPECT_EQ(camera.wrong, 0);
  EXPECT_GT(camera.paired, until_then + 50);
}

TEST(StrobeMatcher, AStrobeThatIsGoneForAWhileComesBack) {
  StrobeMatcher matcher(narrow());
  Camera camera;
  camera.edge_seen = [](int n) { return n < 100 || n > 160; };
  camera.film(matcher, 300);
  EXPECT_EQ(camera.wrong, 0);
  EXPECT_GT(camera.paired, 170);
}

}  // namespace
}  // namespace birdseye
