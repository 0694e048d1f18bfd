#include "host/files/write_files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "calibration/record/sha256.hpp"
#include "drivers/system/unique_fd.hpp"
#include "host/files/files_sha256.hpp"
#include "host/files/result_folder.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/synced_files.hpp"

namespace birdseye::host {
namespace {

std::string fixed_place;  ///< that nothing is renamed to
bool has_links = true;    ///< the disk

}  // namespace
}  // namespace birdseye::host

// In place of libc's.
extern "C" int rename(const char* from, const char* to) noexcept {
  if (birdseye::host::fixed_place != to)
    return static_cast<int>(::syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
  errno = EPERM;
  return -1;
}
extern "C" int link(const char* from, const char* to) noexcept {
  if (birdseye::host::has_links) return static_cast<int>(::syscall(SYS_linkat, AT_FDCWD, from, AT_FDCWD, to, 0));
  errno = EPERM;
  return -1;
}

namespace birdseye::host {
namespace {

TEST(WriteFiles, NamesInOtherEncodingsLoseNoFigures) {
  const nlohmann::json json{{"rejected", "line 82: \"ung\xFCltig\" is no number"}, {"rms_mm", 0.5}};
  const auto back = nlohmann::json::parse(text_of(json));
  EXPECT_EQ(back["rms_mm"], 0.5);
  EXPECT_EQ(back["rejected"].get<std::string>().substr(0, 13), "line 82: \"ung");
}

std::size_t files_in(const birdseye::testing::Scratch& scratch) {
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(scratch.path())) ++count;
  return count;
}

/// What lies beside it, as what a power cut left of another write, is nobody's to remove.
TEST(WriteFiles, AFileOfTheUsersOwnNamedPartIsLeftAlone) {
  const birdseye::testing::Scratch scratch;
  const std::string path = scratch.file("result.json", "former");
  const std::string part = scratch.file("result.json.part", "the user's own");
  ASSERT_TRUE(write_file(path, "new"));
  EXPECT_EQ(birdseye::testing::contents_of(path), "new");
  EXPECT_EQ(birdseye::testing::contents_of(part), "the user's own");
  EXPECT_EQ(files_in(scratch), 2U);
}

TEST(WriteFiles, ALongNameIsWrittenAndATooLongOneRefusedAsSuch) {
  const birdseye::testing::Scratch scratch;
  EXPECT_TRUE(write_file(scratch / (std::string(245, 'a') + ".json"), "new"));
  const auto too_long = write_file(scratch / (std::string(300, 'a') + ".json"), "new");
  ASSERT_FALSE(too_long);
  EXPECT_NE(too_long.error().what.find("is too long a name"), std::string::npos) << too_long.error().what;
  EXPECT_EQ(files_in(scratch), 1U);
}

TEST(WriteFiles, TwoThatAreTheSameFileAreRefusedBeforeAnythingIsWritten) {
  const birdseye::testing::Scratch scratch;
  const std::filesystem::path folder = scratch.path();
  std::filesystem::create_directory(folder / "b");
  const auto refused = [](const std::filesystem::path& one, const std::filesystem::path& other) {
    const auto written = write_files({{one, "text"}, {other, "figures"}});
    return !written && written.error().what.find("is named twice") != std::string::npos;
  };
  EXPECT_TRUE(refused(folder / "a.txt", folder / "./a.txt"));
  EXPECT_TRUE(refused(folder / "a.txt", folder / "b/../a.txt"));
  std::filesystem::create_directory_symlink(folder, folder / "also");
  EXPECT_TRUE(refused(folder / "a.txt", folder / "also/a.txt"));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.txt"));
  (void)scratch.file("a.txt", "former");
  std::filesystem::create_symlink("a.txt", folder / "link.txt");
  EXPECT_TRUE(refused(folder / "a.txt", folder / "link.txt"));
  EXPECT_EQ(birdseye::testing::contents_of(folder / "a.txt"), "former");
  EXPECT_TRUE(write_files({{folder / "a.txt", "a"}, {folder / "b/a.txt", "b"}}));
  EXPECT_TRUE(write_files({{"/dev/null", "a"}, {"/dev/null", "b"}}));
}

TEST(WriteFiles, AFileKeepsItsMode) {
  const birdseye::testing::Scratch scratch;
  const std::string path = scratch.file("key.txt", "former");
  for (const auto mode : {std::filesystem::perms(0600), std::filesystem::perms(0664)}) {
    std::filesystem::permissions(path, mode);
    ASSERT_TRUE(write_file(path, "new"));
    EXPECT_EQ(std::filesystem::status(path).permissions(), mode);
  }
}

/// The descriptor stands for standard output that goes into a file, into which the program prints, too.
TEST(WriteFiles, ALinkToADescriptorStaysAndIsWrittenTo) {
  const birdseye::testing::Scratch scratch;
  const std::string into = scratch / "printed.txt";
  const UniqueFd fd(::open(into.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600));
  ASSERT_TRUE(fd);
  ASSERT_EQ(::write(fd.get(), "printed\n", 8), 8);
  const std::filesystem::path link = scratch / "out.txt";
  std::filesystem::create_symlink(fmt::format("/proc/self/fd/{}", fd.get()), link);
  ASSERT_TRUE(write_file(link, "written\n"));
  ASSERT_EQ(::write(fd.get(), "printed\n", 8), 8);
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_EQ(birdseye::testing::contents_of(into), "printed\nwritten\nprinted\n");
  EXPECT_EQ(files_in(scratch), 2U);
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
  const auto refused = write_files({{path, "new"}, {scratch / "no folder" / "b.txt", "new"}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().what.find("not put back"), std::string::npos) << refused.error().what;
  EXPECT_EQ(birdseye::testing::contents_of(path), "former");
  EXPECT_EQ(files_in(scratch), 1U);
}

/// As in another's folder where each may remove but the own files.
TEST(WriteFiles, WhereOneCannotBeReplacedAllAreAsBefore) {
  const birdseye::testing::Scratch scratch;
  const std::string first = scratch.file("a.txt", "former a"), last = scratch.file("z.txt", "former z");
  const std::filesystem::path fresh = scratch / "new.txt";
  std::filesystem::permissions(first, std::filesystem::perms(0640));
  std::filesystem::create_symlink("a.txt", scratch / "link.txt");
  fixed_place = last;
  const auto refused = write_files({{first, "new"}, {fresh, "new"}, {last, "new"}});
  const auto of_link = write_files({{scratch / "link.txt", "new"}, {last, "new"}});
  fixed_place.clear();
  for (const auto& one : {refused, of_link}) {
    ASSERT_FALSE(one);
    EXPECT_NE(one.error().what.find("z.txt: cannot be replaced"), std::string::npos) << one.error().what;
    EXPECT_EQ(one.error().what.find("not put back"), std::string::npos) << one.error().what;
  }
  EXPECT_EQ(birdseye::testing::contents_of(first), "former a");
  EXPECT_EQ(std::filesystem::status(first).permissions(), std::filesystem::perms(0640));
  EXPECT_TRUE(std::filesystem::is_symlink(scratch / "link.txt"));
  EXPECT_EQ(birdseye::testing::contents_of(last), "former z");
  EXPECT_FALSE(std::filesystem::exists(fresh));
  EXPECT_EQ(files_in(scratch), 3U) << "nothing else is left";
  ASSERT_TRUE(write_files({{first, "new"}, {fresh, "new"}, {last, "new"}}));
  for (const std::filesystem::path& path : {std::filesystem::path(first), fresh, std::filesystem::path(last)})
    EXPECT_EQ(birdseye::testing::contents_of(path), "new") << path;
  EXPECT_EQ(files_in(scratch), 4U) << "no former one is left";
}

TEST(WriteFiles, WhereAPipeTakesNothingNoFileIsReplaced) {
  const birdseye::testing::Scratch scratch;
  const std::string path = scratch.file("a.txt", "former"), pipe = scratch / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const auto refused = write_files({{pipe, "nobody reads it"}, {path, "new"}});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("nobody reads this pipe"), std::string::npos) << refused.error().what;
  EXPECT_EQ(birdseye::testing::contents_of(path), "former");
  EXPECT_EQ(files_in(scratch), 2U);
}

/// As some sticks and shares are.
TEST(WriteFiles, OnADiskWithoutHardLinksWhatStaysReplacedIsNamed) {
  const birdseye::testing::Scratch scratch;
  const std::string first = scratch.file("a.txt", "former"), last = scratch.file("z.txt", "former");
  fixed_place = last;
  has_links = false;
  const auto refused = write_files({{first, "new"}, {scratch / "new.txt", "new"}, {last, "new"}});
  fixed_place.clear();
  has_links = true;
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("z.txt: cannot be replaced"), std::string::npos) << refused.error().what;
  EXPECT_NE(refused.error().what.find("not put back: " + first + ")"), std::string::npos) << refused.error().what;
  EXPECT_EQ(birdseye::testing::contents_of(first), "new");
  EXPECT_EQ(files_in(scratch), 2U);
}

const std::vector<std::filesystem::path> kNoInputs;

/// A command's that writes a.txt and p1.png, p2.png and so on.
ResultFolder folder_in(const birdseye::testing::Scratch& scratch) {
  return {scratch.path(), "export", "export.json", "a\\.txt|p[0-9]+\\.png"};
}

TEST(ResultFolder, WhatAnEarlierRunListsIsRemovedAndNothingElse) {
  const birdseye::testing::Scratch scratch;
  const ResultFolder folder = folder_in(scratch);
  (void)scratch.file("notes.txt", "the user's own");
  for (const char* const listed : {R"(["a.txt", "notes.txt"])", R"({"a.txt": "in words"})"}) {
    (void)scratch.file("a.txt", "an earlier run's");
    (void)scratch.file("export.json", std::string(R"({"verdict": "pass", "files": )") + listed + "}");
    EXPECT_TRUE(make_empty(folder, kNoInputs));
    EXPECT_FALSE(std::filesystem::exists(scratch / "a.txt"));
    EXPECT_EQ(birdseye::testing::contents_of(scratch / "notes.txt"), "the user's own");
  }
  // A run that did not end left what it had written.
  const std::string begun = scratch.file("p1.png", "");
  EXPECT_TRUE(make_empty(folder, kNoInputs));
  EXPECT_FALSE(std::filesystem::exists(begun));
}

TEST(ResultFolder, WhatNoEarlierRunListsIsRefused) {
  const birdseye::testing::Scratch scratch;
  const ResultFolder folder = folder_in(scratch);
  const std::string own = scratch.file("p1.png", "the user's own");
  EXPECT_FALSE(make_empty(folder, kNoInputs)) << "there is no sheet";
  for (const char* const sheet : {"", "[]", R"({"files": ["p1.png"]})", R"({"verdict": "pass"})",
                                  R"({"verdict": "pass", "files": 1})", R"({"verdict": "pass", "files": ["a.txt"]})"}) {
    (void)scratch.file("export.json", sheet);
    EXPECT_FALSE(make_empty(folder, kNoInputs)) << sheet;
    EXPECT_EQ(birdseye::testing::contents_of(own), "the user's own");
    EXPECT_EQ(birdseye::testing::contents_of(scratch / "export.json"), sheet);
  }
  std::filesystem::remove(own);
  (void)scratch.file("a.txt", "an earlier run's");
  EXPECT_TRUE(check_free(folder, kNoInputs));
  EXPECT_FALSE(check_free(folder, {scratch.path() / "a.txt"})) << "it is read";
  std::filesystem::create_directory(scratch / "b");
  for (const char* const name : {"a.txt", "b/../p7.png", "export.json"})
    EXPECT_FALSE(check_free(folder, kNoInputs, {scratch.path() / name})) << name;
  for (const char* const name : {"figures.json", "b/a.txt"})
    EXPECT_TRUE(check_free(folder, kNoInputs, {scratch.path() / name})) << name;
}

TEST(ResultFolder, ASheetWithoutAVerdictIsKnownByItsKey) {
  const birdseye::testing::Scratch scratch;
  ResultFolder folder = folder_in(scratch);
  folder.key = "sweeps";
  folder.option = "--study";
  const std::string text = scratch.file("a.txt", "the user's own");
  (void)scratch.file("export.json", R"({"files": ["a.txt"]})");
  const auto own = make_empty(folder, kNoInputs);
  ASSERT_FALSE(own);
  EXPECT_NE(own.error().what.find("give another --study, or move"), std::string::npos) << own.error().what;
  (void)scratch.file("export.json", R"({"sweeps": [], "files": ["a.txt"]})");
  (void)scratch.file("p1.png", "the user's own");
  EXPECT_FALSE(make_empty(folder, kNoInputs)) << "it lists no p1.png";
  std::filesystem::remove(scratch / "p1.png");
  EXPECT_TRUE(make_empty(folder, kNoInputs));
  EXPECT_FALSE(std::filesystem::exists(text));
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
  std::filesystem::remove(path + ".part");
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
