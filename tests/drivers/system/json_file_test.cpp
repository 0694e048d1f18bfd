// What is read as JSON is JSON, and a file.
#include "drivers/system/json_file.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

TEST(JsonFile, IsReadAndWhatIsNoneIsRefusedByItsPath) {
  const testing::Scratch scratch;
  const auto read = read_json_file(scratch.file("a.json", R"({"a": [1, 2.5, "b"]})"));
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ((*read)["a"][2], "b");

  const std::string deep = std::string(100'000, '[') + std::string(100'000, ']');
  for (const std::string& text : {std::string(), std::string("{\"a\": "), std::string("{} {}"), deep}) {
    const std::string path = scratch.file("none.json", text);
    const auto none = read_json_file(path);
    ASSERT_FALSE(none) << text.substr(0, 20);
    EXPECT_EQ(none.error().code, Errc::bad_format);
    EXPECT_EQ(none.error().what.find(path + ": is not JSON"), 0U) << none.error().what;
  }
  EXPECT_EQ(read_json_file(scratch / "missing.json").error().code, Errc::not_found);
  EXPECT_EQ(read_json_file("/dev/zero").error().code, Errc::bad_value);
}

}  // namespace
}  // namespace birdseye
