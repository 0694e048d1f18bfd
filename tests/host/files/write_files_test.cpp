#include "host/files/write_files.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace birdseye::host {
namespace {

TEST(WriteFiles, NamesInOtherEncodingsLoseNoFigures) {
  const nlohmann::json json{{"rejected", "line 82: \"ung\xFCltig\" is no number"}, {"rms_mm", 0.5}};
  const auto back = nlohmann::json::parse(text_of(json));
  EXPECT_EQ(back["rms_mm"], 0.5);
  EXPECT_EQ(back["rejected"].get<std::string>().substr(0, 13), "line 82: \"ung");
}

}  // namespace
}  // namespace birdseye::host
