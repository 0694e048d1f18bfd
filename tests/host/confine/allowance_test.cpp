#include "host/confine/allowance.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

TEST(Readable, AHeaderAmongTooManyFilesIsRefused) {
  const testing::Scratch scratch;
  constexpr int kMost = 10'000;
  for (int i = 0; i < kMost; ++i) std::ofstream(scratch / std::to_string(i));
  EXPECT_TRUE(readable_for(scratch / "0"));
  EXPECT_TRUE(readable_for(scratch.path()));
  (void)scratch.file("ct.nhdr", "x");
  const auto among = readable_for(scratch / "ct.nhdr");
  ASSERT_FALSE(among);
  EXPECT_THAT(among.error().what, ::testing::HasSubstr("put it and those into a folder of their own"));
}

TEST(Readable, ADirectoryOfAMediumStandsForItsFolderByItsName) {
  const testing::Scratch scratch;
  (void)scratch.file("DICOMDIR", "0123456789");
  (void)scratch.file("INDEX", "0123456789");
  EXPECT_EQ(readable_for(scratch / "DICOMDIR").value().listed, std::filesystem::canonical(scratch.path()));
  EXPECT_EQ(readable_for(scratch / "DICOMDIR").value().bytes, 20U);
  EXPECT_TRUE(readable_for(scratch / "INDEX").value().listed.empty());
  EXPECT_EQ(readable_for(scratch / "INDEX").value().files.size(), 1U);
}

TEST(Readable, FilesOfAFolderJustifyTimeOneByOneAndThoseBesideAHeaderTogether) {
  const testing::Scratch scratch;
  for (const char* name : {"a", "b", "c"}) (void)scratch.file(name, std::string(1'000'000, 'x'));
  const double of_one_s = allowance_of(1'000'000).processor_time.seconds();
  EXPECT_NEAR(readable_for(scratch.path()).value().processor_time.seconds(), 3 * of_one_s, 1e-6);
  EXPECT_NEAR(readable_for(scratch / "a").value().processor_time.seconds(), of_one_s, 1e-6);
  (void)scratch.file("ct.mhd", "");
  EXPECT_EQ(readable_for(scratch / "ct.mhd").value().processor_time, allowance_of(3'000'000).processor_time);
}

TEST(Allowance, GrowsWithTheBytesAndHasAFloor) {
  EXPECT_EQ(allowance_of(0).processor_time, Duration::from_ms(2000));
  EXPECT_NEAR(allowance_of(1'000'000).processor_time.seconds(), 12.82, 1e-6);
  EXPECT_NEAR(allowance_of(100'000'000).processor_time.seconds(), 72, 1e-6);
  EXPECT_EQ(allowance_of(0).memory_bytes, 256U << 20U);
  EXPECT_EQ(allowance_of(1000).memory_bytes - allowance_of(0).memory_bytes, 3U * 1032U * 1000U);
  EXPECT_GT(allowance_of(~std::uintmax_t{0}).memory_bytes, std::uintmax_t{1} << 40U);
}

}  // namespace
}  // namespace birdseye::host
