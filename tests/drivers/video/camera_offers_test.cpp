#include "drivers/video/camera_offers.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

namespace birdseye::drivers {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::uint32_t code(const char* name) {
  std::uint32_t code = 0;
  std::memcpy(&code, name, 4);
  return code;
}

SizeOffer size(int width, int height, std::vector<double> rates_hz) {
  return {width, width, 1, height, height, 1, {std::move(rates_hz), 0, 0}};
}
CameraSettings ask(int width, int height, double rate_hz, const std::string& format = "") {
  CameraSettings settings{"v4l2:/dev/video0", width, height, rate_hz};
  settings.format = format;
  return settings;
}

/// As many USB cameras: raw at low rates, compressed at high ones.
const std::vector<FormatOffer> kWebcam = {
    {code("MJPG"), {size(1920, 1080, {30, 60}), size(640, 480, {30})}},
    {code("H264"), {size(1920, 1080, {60})}},
    {code("YUYV"), {size(1920, 1080, {5}), size(640, 480, {30, 15, 59.94})}},
};

TEST(CameraOffers, TakesTheCheapestFormatThatIsFastEnough) {
  const auto small = choose(kWebcam, ask(640, 480, 30));
  ASSERT_TRUE(small) << small.error().what;
  EXPECT_EQ(small->format, PixelFormat::yuyv);
  const auto fast = choose(kWebcam, ask(1920, 1080, 60));
  ASSERT_TRUE(fast) << fast.error().what;
  EXPECT_EQ(fast->format, PixelFormat::mjpeg);
  EXPECT_EQ(fast->fourcc, code("MJPG"));
}

TEST(CameraOffers, TakesTheFormatAskedForOnly) {
  const auto plan = choose(kWebcam, ask(640, 480, 30, "MJPG"));
  ASSERT_TRUE(plan) << plan.error().what;
  EXPECT_EQ(plan->format, PixelFormat::mjpeg);
  const auto refused = choose(kWebcam, ask(1920, 1080, 60, "YUYV"));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, HasSubstr("1920x1080 as YUYV at 5 Hz, not 60"));
  const auto unknown = choose(kWebcam, ask(640, 480, 30, "GREY"));
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().what, HasSubstr("MJPG, H264, YUYV, not GREY"));
}

TEST(CameraOffers, TakesARateThatIsNearEnough) {
  const auto plan = choose(kWebcam, ask(640, 480, 60));
  ASSERT_TRUE(plan) << plan.error().what;
  EXPECT_DOUBLE_EQ(plan->rate_hz, 59.94);
}

TEST(CameraOffers, SaysWhatRatesThereAre) {
  const auto refused = choose(kWebcam, ask(640, 480, 50));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::unsupported);
  EXPECT_THAT(refused.error().what, HasSubstr("640x480 at 15, 30, 59.94 Hz, not 50"));
  EXPECT_THAT(refused.error().what, HasSubstr("rate_hz"));
}

TEST(CameraOffers, SaysWhatSizesThereAre) {
  const auto refused = choose(kWebcam, ask(800, 600, 30));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, HasSubstr("gives 1920x1080, 640x480, not 800x600"));
}

TEST(CameraOffers, SaysWhatFormatsThereAre) {
  const auto refused = choose({{code("H264"), {}}, {code("BA81"), {}}}, ask(640, 480, 30));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, HasSubstr("H264, BA81, not RGB3"));
  const auto none = choose({}, ask(640, 480, 30));
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().what, HasSubstr("no format at all"));
}

TEST(CameraOffers, SizesAndRatesInRanges) {
  const std::vector<FormatOffer> offers = {{code("NV12"), {{32, 1920, 16, 32, 1080, 2, {{}, 1, 60}}}}};
  const auto plan = choose(offers, ask(640, 480, 59.9));
  ASSERT_TRUE(plan) << plan.error().what;
  EXPECT_DOUBLE_EQ(plan->rate_hz, 59.9);
  const auto uneven = choose(offers, ask(650, 480, 30));
  ASSERT_FALSE(uneven);
  EXPECT_THAT(uneven.error().what, HasSubstr("32x32 to 1920x1080 in steps of 16x2, not 650x480"));
  const auto fast = choose(offers, ask(640, 480, 90));
  ASSERT_FALSE(fast);
  EXPECT_THAT(fast.error().what, HasSubstr("at 1 to 60 Hz, not 90"));
}

TEST(CameraOffers, WhatIsNotSaidIsTried) {
  const auto plan = choose({{code("GREY"), {}}}, ask(123, 45, 7));
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->width_px, 123);
  EXPECT_DOUBLE_EQ(plan->rate_hz, 7);
  EXPECT_TRUE(choose({{code("GREY"), {size(123, 45, {})}}}, ask(123, 45, 7)));
}

TEST(CameraOffers, ColoursBeforeGrey) {
  const auto plan = choose({{code("GREY"), {}}, {code("MJPG"), {}}}, ask(640, 480, 30));
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->format, PixelFormat::mjpeg);
}

TEST(CameraOffers, ALongListMakesAShortLine) {
  FormatOffer many{code("YUYV"), {}};
  for (int i = 1; i <= 500; ++i) many.sizes.push_back(size(16 * i, 9 * i, {30}));
  const auto refused = choose({many}, ask(17, 17, 30));
  ASSERT_FALSE(refused);
  EXPECT_LT(refused.error().what.size(), 250U);
  EXPECT_THAT(refused.error().what, HasSubstr("492 more"));
  EXPECT_THAT(refused.error().what, Not(HasSubstr("\n")));
}

}  // namespace
}  // namespace birdseye::drivers
