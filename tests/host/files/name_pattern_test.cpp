#include "host/files/name_pattern.hpp"

#include <gtest/gtest.h>

#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

TEST(NamePattern, AStarIsAnyLettersAndAQuestionMarkOne) {
  for (const auto& [name, pattern] : {std::pair{"pose.12.txt", "pose.*.txt"},
                                      {"pose.12.txt", "pose.??.txt"},
                                      {"pose.12.txt", "*"},
                                      {"pose.12.txt", "*2*t"},
                                      {"abab", "*ab"},
                                      {"", "*"},
                                      {"a", "a*"},
                                      {"same", "same"}})
    EXPECT_TRUE(matches(name, pattern)) << name << " " << pattern;
  for (const auto& [name, pattern] : {std::pair{"pose.12.txt", "pose.?.txt"},
                                      {"pose.txt", "pose.*.txt"},
                                      {"", "?"},
                                      {"aba", "*ab"},
                                      {"same", "other"},
                                      {"a", ""}})
    EXPECT_FALSE(matches(name, pattern)) << name << " " << pattern;
}

TEST(NamePattern, ManyStarsAreNoTrouble) {
  const std::string name(200, 'a');
  std::string pattern;
  for (int i = 0; i < 60; ++i) pattern += "a*";
  EXPECT_FALSE(matches(name, pattern + "b"));
}

TEST(NamePattern, FilesComeInTheOrderOfTheirNumbers) {
  const testing::Scratch scratch;
  for (const char* name : {"v10.ppm", "v9.ppm", "v2.ppm", "w1.ppm"}) (void)scratch.file(name, "x");
  const auto files = files_matching(scratch.path(), "v*.ppm");
  ASSERT_TRUE(files);
  ASSERT_EQ(files->size(), 3U);
  EXPECT_EQ(files->front().filename(), "v2.ppm");
  EXPECT_EQ(files->back().filename(), "v10.ppm");
  EXPECT_FALSE(files_matching(scratch / "no", "*"));
}

}  // namespace
}  // namespace birdseye::host
