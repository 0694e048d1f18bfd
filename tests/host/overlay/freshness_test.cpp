#include "host/overlay/freshness.hpp"

#include <gtest/gtest.h>

namespace birdseye::host {
namespace {

Freshness at_ms(std::int64_t age_ms, std::int64_t pose_age_ms = 0) {
  const HostTime exposed{5'000'000'000};
  return freshness_at(exposed + Duration::from_ms(age_ms), exposed, Duration::from_ms(pose_age_ms), {});
}

TEST(Freshness, SaysWhyAPictureIsTooOld) {
  EXPECT_EQ(at_ms(120).why_too_old, "");
  EXPECT_EQ(at_ms(121).why_too_old, "the picture is 121 ms old");
  EXPECT_FALSE(at_ms(300).stopped);
  EXPECT_TRUE(at_ms(301).stopped);
  EXPECT_EQ(at_ms(1200).why_too_old, "the video has stopped, 1.2 s ago");
}

/// A predicted pose is older than its frame; one that was measured is not, whatever its age says.
TEST(Freshness, CountsTheAgeOfThePose) {
  EXPECT_EQ(at_ms(60, 60).why_too_old, "");
  EXPECT_EQ(at_ms(60, 61).why_too_old, "the newest pose is 121 ms old");
  EXPECT_EQ(at_ms(60, -500).why_too_old, "");
}

/// Whoever still shows it then has come too late: the overlay goes before the picture.
TEST(Freshness, SaysUntilWhenItMayStayOnTheScreen) {
  const HostTime exposed{5'000'000'000};
  EXPECT_EQ((at_ms(0).overlaid_until - exposed).ns, Duration::from_ms(138).ns);
  EXPECT_EQ((at_ms(0, 40).overlaid_until - exposed).ns, Duration::from_ms(98).ns);
  EXPECT_EQ((at_ms(0, 40).bare_until - exposed).ns, Duration::from_ms(318).ns);
}

}  // namespace
}  // namespace birdseye::host
