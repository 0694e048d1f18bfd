#include "calibration/base/nesting.hpp"

#include <gtest/gtest.h>

#include <string>

namespace birdseye {
namespace {

std::string times(int count, const std::string& text) {
  std::string all;
  for (int i = 0; i < count; ++i) all += text;
  return all;
}

TEST(Nesting, DeepOnesAreFound) {
  for (const auto& text : {"x = " + times(70, "["), "x = " + times(70, "{a=") + "1", times(70, "a.") + "a = 1",
                           "[" + times(70, "'a' . ") + "a]"}) {
    EXPECT_TRUE(nests_too_deeply(text, Notation::toml)) << text;
  }
  for (const auto& text : {"x: " + times(70, "["), times(70, "<a>"), "x:\n  " + times(70, "- ") + "1"}) {
    EXPECT_TRUE(nests_too_deeply(text, Notation::yaml_or_xml)) << text;
  }
  for (const auto& text : {times(70, "["), times(70, "{\"a\":") + "1"})
    EXPECT_TRUE(nests_too_deeply(text, Notation::json)) << text;
}

/// What a parser passes over closes no level: with it a text of any depth would seem flat.
TEST(Nesting, BracketsInStringsAndCommentsHideNone) {
  for (const std::string flat : {R"(["]",)", R"(["\"]",)", R"([{"}]\\":)"}) {
    EXPECT_TRUE(nests_too_deeply(times(70, flat), Notation::json)) << flat;
    EXPECT_FALSE(nests_too_deeply("[" + times(200, flat.substr(flat.find('"'))) + "1]", Notation::json)) << flat;
  }
  for (const std::string flat : {"[\"]\",", "[']',", "[\"\"\"]\"\"\",", "['''\n]''',", "[\"\"\"]\"\"\"\",",
                                 "[''']''''',", "[#]\n", "['\\',#]\n", "[\"\\\"]\",", "[\"\\\\\",#]\"\n"}) {
    EXPECT_TRUE(nests_too_deeply("x = " + times(70, flat), Notation::toml)) << flat;
  }
  EXPECT_TRUE(nests_too_deeply("\"#\"" + times(70, ".a") + " = 1", Notation::toml));
  EXPECT_TRUE(nests_too_deeply("'\"'" + times(70, ".a") + " = 1", Notation::toml));
}

TEST(Nesting, WhatUsersWriteIsNot) {
  for (const auto& text : {"[" + times(200, "[1.5, {}], ") + "2]", "{\"serial\": \"" + times(80, "1.") + "\"}"})
    EXPECT_FALSE(nests_too_deeply(text, Notation::json)) << text;
  for (const auto& text : {std::string("[tracker]\ndevice = \"/dev/serial/by-id/usb-FTDI_1.2.3\"\n"),
                           "# " + times(80, ".") + "\n[a.b.c]\n", "x = [" + times(200, "0.5, ") + "1]\n",
                           times(200, "[[fault]]\nname = \"drop_byte\"\n"), times(200, "name = \"[left\"\n"),
                           times(200, "# [a list that goes on\n") + "x = \"\"\"" + times(200, "{\n") + "\"\"\"\n"}) {
    EXPECT_FALSE(nests_too_deeply(text, Notation::toml)) << text;
  }
  for (const auto& text : {"# " + times(80, "-") + "\n---\nx: 1\n", "data: [" + times(200, " -0.5,") + " 1. ]\n",
                           "<a>" + times(200, "<b>1. 2.</b><c/>") + "</a>", times(200, "-\n"),
                           "x: " + times(90, "-") + "\n", "<data>" + times(200, " 1. -2.") + "</data>"}) {
    EXPECT_FALSE(nests_too_deeply(text, Notation::yaml_or_xml)) << text;
  }
}

}  // namespace
}  // namespace birdseye
