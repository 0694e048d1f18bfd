#include "host/files/write_files.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

TEST(WriteFiles, NamesInOtherEncodingsLoseNoFigures) {
  const nlohmann::json json{{"rejected", "line 82: \"ung\xFCltig\" is no number"}, {"rms_mm", 0.5}};
  const auto back = nlohmann::json::parse(text_of(json));
  EXPECT_EQ(back["rms_mm"], 0.5);
  EXPECT_EQ(back["rejected"].get<std::string>().substr(0, 13), "line 82: \"ung");
}

/// What a power cut leaves while a file is written: the former file, and the new one's beginning beside it.
TEST(WriteFiles, WhatAnInterruptedWriteLeftIsWrittenOver) {
  const birdseye::testing::Scratch scratch;
  const std::string path = scratch.file("result.json", "former");
  const std::string part = scratch.file("result.json.part", "beginning of a long text");
  EXPECT_EQ(birdseye::testing::contents_of(path), "former");
  ASSERT_TRUE(write_file(path, "new"));
  EXPECT_EQ(birdseye::testing::contents_of(path), "new");
  EXPECT_FALSE(std::filesystem::exists(part));
}

TEST(WriteFiles, WhereOneCannotBeWrittenNoneIsReplaced) {
  const birdseye::testing::Scratch scratch;
  const std::string path = scratch.file("a.txt", "former");
  EXPECT_FALSE(write_files({{path, "new"}, {scratch / "no folder" / "b.txt", "new"}}));
  EXPECT_EQ(birdseye::testing::contents_of(path), "former");
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
}

}  // namespace
}  // namespace birdseye::host
