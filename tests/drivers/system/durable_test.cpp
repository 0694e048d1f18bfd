#include "drivers/system/durable.hpp"

#include <gtest/gtest.h>

#include "tests/support/scratch.hpp"
#include "tests/support/synced_files.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;

using testing::forget_synced;
using testing::is_synced;
using testing::Scratch;

TEST(MakeFolderDurably, BringsTheNameOfEachNewFolderOntoTheDisk) {
  for (const char* last : {"c", "c/"}) {
    const Scratch scratch;
    forget_synced();
    ASSERT_TRUE(make_folder_durably(scratch / "a/b" / last));
    EXPECT_TRUE(fs::is_directory(scratch / "a/b/c"));
    EXPECT_TRUE(is_synced(scratch.path()));
    EXPECT_TRUE(is_synced(scratch / "a"));
    EXPECT_TRUE(is_synced(scratch / "a/b"));
  }
}

TEST(MakeFolderDurably, OfAFolderBelowOneThatIsThereOnlyTheNewNamesCount) {
  const Scratch scratch;
  fs::create_directories(scratch / "a/b");
  forget_synced();
  ASSERT_TRUE(make_folder_durably(scratch / "a/b"));
  EXPECT_FALSE(is_synced(scratch / "a")) << "nothing was made";
  ASSERT_TRUE(make_folder_durably(scratch / "a/b/c"));
  EXPECT_TRUE(is_synced(scratch / "a/b"));
  EXPECT_FALSE(is_synced(scratch / "a"));
}

TEST(MakeFolderDurably, NamesAFolderThatCannotBeMade) {
  const Scratch scratch;
  const std::string file = scratch.file("file", "no folder");
  const auto made = make_folder_durably(file + "/below");
  ASSERT_FALSE(made);
  EXPECT_NE(made.error().what.find(file + "/below: the folder cannot be made"), std::string::npos) << made.error().what;
}

}  // namespace
}  // namespace birdseye
