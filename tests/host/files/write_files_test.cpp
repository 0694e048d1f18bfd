#include "host/files/write_files.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "calibration/record/sha256.hpp"
#include "host/files/files_sha256.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/synced_files.hpp"

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

TEST(WriteFiles, IsOnTheDiskByItsName) {
  const birdseye::testing::Scratch scratch;
  const std::string path = scratch.file("result.json", "former");
  birdseye::testing::forget_synced();
  ASSERT_TRUE(write_file(path, "new"));
  EXPECT_TRUE(birdseye::testing::is_synced(path)) << "a power cut leaves the name without the text";
  EXPECT_TRUE(birdseye::testing::is_synced(scratch.path())) << "or the former text by that name";
}

TEST(WriteFiles, WhereOneCannotBeWrittenNoneIsReplaced) {
  const birdseye::testing::Scratch scratch;
  const std::string path = scratch.file("a.txt", "former");
  EXPECT_FALSE(write_files({{path, "new"}, {scratch / "no folder" / "b.txt", "new"}}));
  EXPECT_EQ(birdseye::testing::contents_of(path), "former");
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
}

TEST(FilesSha256, AFileIsAsTheSheetBesideItSaysOrRefused) {
  const birdseye::testing::Scratch scratch;
  const std::string field = scratch.file("field.mha", "displacements");
  EXPECT_TRUE(check_against_sheet(field)) << "no sheet tells of it";
  (void)scratch.file("result.json", R"({"verdict": "pass"})");
  EXPECT_TRUE(check_against_sheet(field)) << "nor did those of earlier versions";
  (void)scratch.file("result.json",
                     R"({"sha256": {"field.mha": ")" + calibration::sha256_of("displacements") + R"("}})");
  EXPECT_TRUE(check_against_sheet(field));
  (void)scratch.file("field.mha", "displacementt");
  const auto edited = check_against_sheet(field);
  ASSERT_FALSE(edited);
  EXPECT_NE(edited.error().what.find("field.mha: is not the file of which"), std::string::npos) << edited.error().what;
}

TEST(FilesSha256, ASheetThatIsThereAndCannotBeReadIsRefused) {
  const birdseye::testing::Scratch scratch;
  const std::string field = scratch.file("field.mha", "displacements");
  const std::string sheet =
      scratch.file("result.json", R"({"sha256": {"field.mha": ")" + calibration::sha256_of("others") + R"("}})");
  EXPECT_FALSE(check_against_sheet(field));
  std::filesystem::resize_file(sheet, std::filesystem::file_size(sheet) - 3);
  EXPECT_NE(check_against_sheet(field).error().what.find("result.json: is not JSON"), std::string::npos);
  std::filesystem::remove(sheet);
  ASSERT_EQ(::mkfifo(sheet.c_str(), 0600), 0);
  EXPECT_NE(check_against_sheet(field).error().what.find("result.json: is no file"), std::string::npos);
}

TEST(WriteFiles, NothingIsWrittenThroughALinkNorWaitedFor) {
  const birdseye::testing::Scratch scratch;
  const std::string other = scratch.file("other.txt", "another's"), path = scratch / "j.json";
  std::filesystem::create_symlink(other, path + ".part");
  EXPECT_TRUE(write_file(path, "ours"));
  EXPECT_EQ(birdseye::testing::contents_of(other), "another's");
  EXPECT_EQ(birdseye::testing::contents_of(path), "ours");
  EXPECT_FALSE(std::filesystem::is_symlink(path));
  ASSERT_EQ(::mkfifo((path + ".part").c_str(), 0600), 0);
  EXPECT_TRUE(write_file(path, "again"));
  EXPECT_EQ(birdseye::testing::contents_of(path), "again");

  const std::string pipe = scratch / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_FALSE(write_file(pipe, "nobody reads it"));
  EXPECT_TRUE(write_file("/dev/null", "anything"));
}

TEST(FilesSha256, OfAFolderNamesAndContentsCount) {
  const birdseye::testing::Scratch scratch;
  (void)scratch.file("liver.nii", "a");
  (void)scratch.file("tumour.nii", "b");
  const std::string both = *files_sha256(scratch.path());
  (void)scratch.file("liver.nii", "b");
  (void)scratch.file("tumour.nii", "a");
  EXPECT_NE(*files_sha256(scratch.path()), both);
  EXPECT_FALSE(files_sha256(scratch / "none"));
}

}  // namespace
}  // namespace birdseye::host
