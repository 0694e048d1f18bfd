#include "drivers/system/program.hpp"

#include <gtest/gtest.h>

namespace birdseye {
namespace {

TEST(InOneLine, NothingOfAFileMovesATerminalsCursor) {
  EXPECT_EQ(in_one_line("-0.1\x1b[2J\n\t\x7f!"), "-0.1 [2J   !");
  EXPECT_EQ(in_one_line("left-\xC2\x9B"
                        "31m"),
            "left-  31m")
      << "a CSI of one character";
  EXPECT_EQ(in_one_line("Leber gr\xC3\xB6\xC3\x9F"
                        "er \xE2\x80\x93 \xF0\x9F\x90\xA6"),
            "Leber gr\xC3\xB6\xC3\x9F"
            "er \xE2\x80\x93 \xF0\x9F\x90\xA6");
  EXPECT_EQ(in_one_line("40\xB9"
                        "9 \xE2\x80 \xC3"),
            "40?9 ?? ?");
}

TEST(InOneLine, OfALongTextTheMiddleIsLeftOut) {
  EXPECT_EQ(in_one_line(std::string(2000, 'a')).size(), 2000U);
  const std::string cut = in_one_line("begin " + std::string(1 << 20, 'a') + " end");
  EXPECT_LT(cut.size(), 2100U);
  EXPECT_TRUE(cut.starts_with("begin aaa") && cut.ends_with("aaa end")) << cut;
  std::string accents;
  for (int i = 0; i < 3000; ++i) accents += "\xC3\xB6";
  EXPECT_EQ(in_one_line("x" + accents).find('?'), std::string::npos) << "no character is cut in two";
}

}  // namespace
}  // namespace birdseye
