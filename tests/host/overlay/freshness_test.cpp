#include "host/overlay/freshness.hpp"

#include <gtest/gtest.h>

namespace birdseye::host {
namespace {

Freshness at_ms(std::int64_t age_ms, std::int64_t pose_age_ms = 0) {
  const HostTime exposed{5'000'000'000};
  return freshness_at(exposed + Duration::from_ms(age_ms), {exposed}, Duration::from_ms(pose_age_ms), {});
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

/// It counts as old as it may be: by two sigmas.
TEST(Freshness, CountsHowWellTheExposuresTimeIsKnown) {
  const HostTime exposed{5'000'000'000};
  const Exposure unsure{exposed, Duration::from_ms(20), {}};
  EXPECT_EQ(freshness_at(exposed + Duration::from_ms(80), unsure, {}, {}).why_too_old, "");
  const Freshness old = freshness_at(exposed + Duration::from_ms(81), unsure, {}, {});
  EXPECT_EQ(old.why_too_old, "the picture is 121 ms old");
  EXPECT_EQ(old.age.ns, Duration::from_ms(81).ns);
  EXPECT_EQ((old.overlaid_until - exposed).ns, Duration::from_ms(98).ns);
}

TEST(Freshness, OfAStampAheadOfTheClockTheArrivalCounts) {
  const HostTime arrived{5'000'000'000};
  const Duration sigma = Duration::from_ms(2);
  const auto stamped = [&](std::int64_t ms) {
    return exposure_of(RelatedTime<HostTime>{arrived + Duration::from_ms(ms), sigma}, {}, arrived);
  };
  EXPECT_EQ(stamped(-30).at.ns, arrived.ns - 30'000'000);
  EXPECT_EQ(stamped(7).doubt, "") << "three sigmas and what it takes to read a clock";
  const Exposure ahead = stamped(500);
  EXPECT_EQ(ahead.at.ns, arrived.ns);
  EXPECT_EQ(ahead.doubt, "the frames' stamps lie 500 ms ahead of the clock: how old they are is not known");
  EXPECT_EQ(freshness_at(arrived, ahead, {}, {}).why_too_old, ahead.doubt) << "no overlay from the first frame on";
  EXPECT_EQ(freshness_at(arrived, ahead, Duration::from_ms(510), {}).why_too_old, ahead.doubt)
      << "it is the stamp that makes the pose look old";
  EXPECT_TRUE(freshness_at(arrived + Duration::from_ms(301), ahead, {}, {}).stopped);
}

TEST(Freshness, APictureBearsNoOverlayBeforeTheClocksAreRelated) {
  const HostTime arrived{5'000'000'000};
  const Exposure unknown = exposure_of(std::nullopt, Duration::from_ms(2), arrived);
  EXPECT_EQ(unknown.at.ns, arrived.ns);
  EXPECT_EQ(freshness_at(arrived, unknown, {}, {}).why_too_old,
            "the appliance has not told its time yet: how old the picture is is not known");
  EXPECT_TRUE(freshness_at(arrived + Duration::from_ms(301), unknown, {}, {}).stopped);
}

}  // namespace
}  // namespace birdseye::host
