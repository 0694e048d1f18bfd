#include "calibration/base/picture_size.hpp"

#include <gtest/gtest.h>

namespace birdseye {
namespace {

TEST(PictureSize, IsReadWholeAndHasNoSideBelowOnePixel) {
  const auto size = parse_picture_size("1280x720");
  ASSERT_TRUE(size);
  EXPECT_EQ(size->width_px, 1280);
  EXPECT_EQ(size->height_px, 720);
  for (const char* wrong : {"", "x", "1280", "1280x", "x720", "1280x720junk", "1280 x720", " 1280x720", "-5x3", "5x-3",
                            "0x0", "5x0", "1.5x3", "99999999999x3", "3x3x3", "1280X720"})
    EXPECT_FALSE(parse_picture_size(wrong)) << wrong;
}

}  // namespace
}  // namespace birdseye
