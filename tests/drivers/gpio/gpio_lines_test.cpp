#include "drivers/gpio/gpio_lines.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace birdseye::drivers {
namespace {

using ::testing::HasSubstr;

GpioSettings settings(const std::string& chip) {
  GpioSettings settings;
  settings.chip = chip;
  settings.pedal = "foot-pedal";
  return settings;
}

// What a chip does is tested on the kernel's own simulated one, in a virtual machine.
TEST(GpioLines, SaysWhatChipIsMissing) {
  for (const char* chip : {"/dev/gpiochip-nowhere", "no-such-label"}) {
    const auto lines = GpioLines::open(settings(chip));
    ASSERT_FALSE(lines) << chip;
    EXPECT_EQ(lines.error().code, Errc::not_found) << lines.error().what;
    EXPECT_THAT(lines.error().what, HasSubstr(chip));
  }
}

TEST(GpioLines, SaysWhatIsNoChip) {
  const auto lines = GpioLines::open(settings("/dev/null"));
  ASSERT_FALSE(lines);
  EXPECT_EQ(lines.error().code, Errc::unsupported) << lines.error().what;
  const auto unnamed = GpioLines::open(settings(""));
  ASSERT_FALSE(unnamed);
  EXPECT_EQ(unnamed.error().code, Errc::bad_value) << unnamed.error().what;
}

}  // namespace
}  // namespace birdseye::drivers
