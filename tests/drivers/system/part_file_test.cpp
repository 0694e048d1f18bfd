#include "drivers/system/part_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <optional>
#include <string>

#include "tests/support/scratch.hpp"
#include "tests/support/synced_files.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;

using testing::contents_of;
using testing::forget_synced;
using testing::is_synced;
using testing::Scratch;

std::ptrdiff_t files_in(const fs::path& folder) {
  return std::distance(fs::directory_iterator(folder), {});
}

TEST(PartFile, ComesIntoItsPlaceWholeAndOnTheDisk) {
  const Scratch scratch;
  const fs::path place = scratch.file("a.nii.gz", "the former");
  auto part = PartFile::make(place);
  ASSERT_TRUE(part) << part.error().what;
  EXPECT_EQ(part->path().filename(), "a.nii.gz");
  std::ofstream(part->path()) << "the new one";
  EXPECT_EQ(contents_of(place), "the former");
  forget_synced();
  const auto put = part->put_durably();
  ASSERT_TRUE(put) << put.error().what;
  EXPECT_TRUE(is_synced(place));
  EXPECT_TRUE(is_synced(scratch.path()));
  EXPECT_EQ(contents_of(place), "the new one");
  EXPECT_EQ(files_in(scratch.path()), 1) << "its folder is gone before it is";
}

TEST(PartFile, HasThePermissionsOfTheFormerFile) {
  const Scratch scratch;
  for (const mode_t mode : {0600U, 0640U, 0444U}) {
    const fs::path place = scratch.file(std::to_string(mode) + ".nrrd", "the former");
    ASSERT_EQ(::chmod(place.c_str(), mode), 0);
    auto part = PartFile::make(place);
    ASSERT_TRUE(part) << part.error().what;
    std::ofstream(part->path()) << "the new one";
    const auto put = part->put_durably();
    ASSERT_TRUE(put) << put.error().what;
    EXPECT_EQ(contents_of(place), "the new one");
    struct stat now = {};
    ASSERT_EQ(::stat(place.c_str(), &now), 0);
    EXPECT_EQ(now.st_mode & 0777, mode);
  }
}

TEST(PartFile, NothingIsLeftOfOneThatDoesNotGetThere) {
  const Scratch scratch;
  {
    auto first = PartFile::make(scratch / "a.mha");
    auto second = PartFile::make(scratch / "a.mha");
    ASSERT_TRUE(first && second);
    EXPECT_NE(first->path(), second->path());
    for (const PartFile* part : {&*first, &*second}) std::ofstream(part->path()) << "a half";
    std::optional<PartFile> moved(*std::move(first));
    *moved = *std::move(second);
    EXPECT_EQ(contents_of(moved->path()), "a half");
  }
  EXPECT_EQ(files_in(scratch.path()), 0);
}

TEST(PartFile, WhatIsNoFileIsRefusedByItsName) {
  const Scratch scratch;
  fs::create_directory(scratch / "dir.mha");
  ASSERT_EQ(::mkfifo((scratch / "pipe.mha").c_str(), 0600), 0);
  for (const auto& [name, why] : {std::pair{"dir.mha", "is a folder"},
                                  {"none/", "is a folder"},
                                  {"pipe.mha", "is a pipe or a device"},
                                  {"none/a.mha", "cannot be written; check the folder"}}) {
    const auto part = PartFile::make(scratch / name);
    ASSERT_FALSE(part) << name;
    EXPECT_NE(part.error().what.find((scratch / name).string() + ": " + why), std::string::npos) << part.error().what;
  }
  EXPECT_EQ(files_in(scratch.path()), 2);
}

TEST(PartFile, NoNameOfAnothersIsTaken) {
  const Scratch scratch;
  const std::string own = scratch.file(".0.part", "the user's own");
  fs::create_symlink(scratch / "none", scratch / ".1.part");
  const auto part = PartFile::make(scratch / "a.mha");
  ASSERT_TRUE(part) << part.error().what;
  EXPECT_EQ(part->folder(), scratch / ".2.part") << "the first that is free: as a simulated operation has it each time";
  EXPECT_EQ(contents_of(own), "the user's own");
}

TEST(WriteDurably, ANewFileHasThePermissionsThatAreAskedForAndAFormerOneItsOwn) {
  const Scratch scratch;
  const fs::path place = scratch / "known";
  const auto mode = [&place] { return fs::status(place).permissions(); };
  const fs::perms of_owner = fs::perms::owner_read | fs::perms::owner_write;
  forget_synced();
  ASSERT_TRUE(write_durably(place, "one", of_owner));
  EXPECT_TRUE(is_synced(place));
  EXPECT_EQ(mode(), of_owner);
  fs::permissions(place, of_owner | fs::perms::others_read);
  ASSERT_TRUE(write_durably(place, "two", of_owner));
  EXPECT_EQ(mode(), of_owner | fs::perms::others_read);
  EXPECT_EQ(contents_of(place), "two");
  EXPECT_EQ(files_in(scratch.path()), 1);
  const auto nowhere = write_durably(scratch / "none/known", "three");
  ASSERT_FALSE(nowhere);
  EXPECT_NE(nowhere.error().what.find("none/known: cannot be written"), std::string::npos) << nowhere.error().what;
}

}  // namespace
}  // namespace birdseye
