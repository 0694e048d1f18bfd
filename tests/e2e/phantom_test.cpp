#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "tests/support/command.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

using testing::run;
using testing::Scratch;

/// The bytes of every file under a folder, by name.
std::map<std::string, std::string> contents(const std::filesystem::path& folder) {
  std::map<std::string, std::string> out;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream in(entry.path(), std::ios::binary);
    out[entry.path().lexically_relative(folder).string()] = std::string(std::istreambuf_iterator<char>(in), {});
  }
  return out;
}

TEST(Phantom, TheSameSeedGivesTheSameBytesAndAnotherDoesNot) {
  const Scratch scratch;
  for (const auto& [name, seed] : {std::pair{"a", 5}, {"b", 5}, {"c", 6}}) {
    const auto made =
        run("birdseye-sim", "phantom --out " + (scratch / name).string() + " --seed " + std::to_string(seed));
    ASSERT_EQ(made.code, 0) << made.output;
    EXPECT_EQ(made.output, "");
  }
  const auto a = contents(scratch / "a");
  EXPECT_GT(a.size(), 100U);
  EXPECT_TRUE(a == contents(scratch / "b"));
  EXPECT_FALSE(a == contents(scratch / "c"));
}

}  // namespace
}  // namespace birdseye
