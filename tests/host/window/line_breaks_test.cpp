#include "host/window/line_breaks.hpp"

#include <gtest/gtest.h>

namespace birdseye::host {
namespace {

std::string in_lines_of(float wide, const std::string& text) {
  return broken_at_spaces(text, wide, [](const std::string& line) { return static_cast<float>(line.size()); });
}

TEST(LineBreaks, TakeNoFigureApart) {
  EXPECT_EQ(in_lines_of(12, "fiducials 0.1, lens 0.0 mm"), "fiducials\n0.1, lens\n0.0 mm");
}

TEST(LineBreaks, AreNoneWhereALineHasRoom) {
  EXPECT_EQ(in_lines_of(26, "fiducials 0.1, lens 0.0 mm"), "fiducials 0.1, lens 0.0 mm");
}

TEST(LineBreaks, LeaveAWordThatIsTooWideWhole) {
  EXPECT_EQ(in_lines_of(8, "snapshot: /a/long/path.png is"), "snapshot:\n/a/long/path.png\nis");
}

}  // namespace
}  // namespace birdseye::host
