#include "hw-sim/phantom/phantom.hpp"

#include <gtest/gtest.h>

#include "hw-sim/phantom/dicom_series.hpp"
#include "hw-sim/phantom/grid.hpp"
#include "hw-sim/phantom/own_files.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::hw_sim {
namespace {

namespace fs = std::filesystem;

using testing::contents_of;
using testing::Scratch;

void write_series(const fs::path& folder, int slices) {
  Grid grid;
  grid.size = {4, 4, slices};
  const std::vector<std::int16_t> hu(grid.voxels(), 40);
  const auto written = write_dicom_series(folder, grid, hu, 1);
  ASSERT_TRUE(written) << written.error().what;
}

TEST(DicomSeries, TakesThePlaceOfAFormerOneAndOfNothingElse) {
  const Scratch scratch;
  write_series(scratch / "ct", 5);
  const std::vector<const char*> others{"ct/IM0001.dcm", "ct/0001.dcm.txt", "ct/1.dcm", "ct/00001.dcm"};
  for (const char* other : others) (void)scratch.file(other, "a user's");
  write_series(scratch / "ct", 3);
  for (const char* other : others) EXPECT_EQ(contents_of(scratch / other), "a user's") << other;
  EXPECT_TRUE(fs::exists(scratch / "ct/0003.dcm"));
  EXPECT_FALSE(fs::exists(scratch / "ct/0004.dcm"));
  EXPECT_FALSE(fs::exists(scratch / "ct/0005.dcm"));
}

/// What the error is: where nothing else is wrong, the CT to build on is not there.
std::string told_of(const Scratch& scratch) {
  PhantomSettings settings;
  settings.folder = scratch / "ph";
  settings.ct = scratch / "none.nii.gz";
  const auto written = write_phantom(settings);
  return written ? "" : written.error().what;
}

TEST(Phantom, ASeriesIsReplacedOnlyWhereItIsAPhantoms) {
  const Scratch scratch;
  EXPECT_NE(told_of(scratch).find("none.nii.gz"), std::string::npos) << told_of(scratch);
  fs::create_directories(scratch / "ph/ct");
  EXPECT_NE(told_of(scratch).find("none.nii.gz"), std::string::npos) << "it is empty";

  (void)scratch.file("ph/ct/0001.dcm", "a patient's");
  const std::string ct = (scratch / "ph/ct").string() + ": is not empty";
  EXPECT_NE(told_of(scratch).find(ct), std::string::npos) << told_of(scratch);
  (void)scratch.file("ph/truth.json", "{\"of\": \"something else\"}");
  EXPECT_NE(told_of(scratch).find(ct), std::string::npos) << told_of(scratch);
  EXPECT_EQ(contents_of(scratch / "ph/ct/0001.dcm"), "a patient's");

  (void)scratch.file("ph/truth.json",
                     R"({"liver_centre_mm": [0, 0, 0], "tumour_centre_mm": [0, 0, 0], "fiducials_mm": [[0, 0, 0]]})");
  EXPECT_NE(told_of(scratch).find("none.nii.gz"), std::string::npos) << told_of(scratch);
}

TEST(Phantom, AHalfSeriesOfItsOwnIsReplaced) {
  const Scratch scratch;
  const fs::path ct = scratch / "ph/ct";
  write_series(ct, 3);
  std::ofstream(ct / "0004.dcm").flush();  // interrupted before its first bytes
  EXPECT_NE(told_of(scratch).find("none.nii.gz"), std::string::npos) << told_of(scratch);

  const std::string refused = ct.string() + ": is not empty";
  const std::string ours = contents_of(ct / "0001.dcm");
  std::string foreign = ours;
  for (std::size_t at = 0; (at = foreign.find("2.25.7711")) != std::string::npos;) foreign.replace(at, 9, "1.2.84011");
  ASSERT_NE(foreign, ours);
  for (const std::string& text : {foreign, std::string("a patient's"), std::string(128, '\0') + "DICM"}) {
    (void)scratch.file("ph/ct/0001.dcm", text);
    EXPECT_NE(told_of(scratch).find(refused), std::string::npos) << told_of(scratch);
    EXPECT_EQ(contents_of(ct / "0001.dcm"), text);
  }
  (void)scratch.file("ph/ct/0001.dcm", ours);
  EXPECT_NE(told_of(scratch).find("none.nii.gz"), std::string::npos) << told_of(scratch);
  (void)scratch.file("ph/ct/IM0001.dcm", ours);
  EXPECT_NE(told_of(scratch).find(refused), std::string::npos) << "another's name";
}

TEST(Phantom, AFileByOneOfItsNamesIsReplacedOnlyWhereItIsListed) {
  for (const std::string name : {"segmentation.nii.gz", "surfaces/liver.ply", "truth.json"}) {
    const Scratch scratch;
    fs::create_directories(scratch / "ph/surfaces");
    const std::string own = scratch.file("ph/" + name, "a user's");
    (void)scratch.file("ph/surfaces/mine.ply", "a user's");
    const std::string list = "ph/birdseye-sim-phantom.json", refused = own + ": is there, and no earlier";
    EXPECT_NE(told_of(scratch).find(refused), std::string::npos) << told_of(scratch);
    for (const char* words : {"{}", R"({"written_by": "birdseye-sim case", "files": []})"}) {
      (void)scratch.file(list, words);
      EXPECT_NE(told_of(scratch).find(list + ": is there, and no earlier"), std::string::npos) << told_of(scratch);
    }
    (void)scratch.file(list, R"({"written_by": "birdseye-sim phantom", "files": ["surfaces/skin.ply"]})");
    EXPECT_NE(told_of(scratch).find(refused), std::string::npos) << told_of(scratch);
    EXPECT_EQ(contents_of(own), "a user's");
    (void)scratch.file(list, R"({"written_by": "birdseye-sim phantom", "files": [")" + name + R"("]})");
    EXPECT_NE(told_of(scratch).find("none.nii.gz"), std::string::npos) << told_of(scratch);
  }
}

TEST(OwnFiles, AreListedBeforeTheyAreWrittenAndTheFormerRunsAreRemoved) {
  const Scratch scratch;
  const OwnFiles own{scratch / "out", "birdseye-sim case", "list.json", {"truth"}, R"(v[0-9]\.png|truth/t\.json)"};
  ASSERT_TRUE(check_free(own)) << "there is no such folder";
  ASSERT_TRUE(begin_files(own, {"v0.png", "v1.png", "truth/t.json"}));
  for (const char* quoted : {R"("v0.png")", R"("v1.png")", R"("truth/t.json")"})
    EXPECT_NE(contents_of(scratch / "out/list.json").find(quoted), std::string::npos) << quoted;
  for (const char* name : {"out/v1.png", "out/truth/t.json", "out/mine.png"}) (void)scratch.file(name, "text");
  fs::create_symlink(scratch / "out/mine.png", scratch / "out/v0.png");
  ASSERT_TRUE(check_free(own));
  ASSERT_TRUE(begin_files(own, {"v0.png"}));
  for (const char* name : {"out/v0.png", "out/v1.png", "out/truth/t.json"})
    EXPECT_FALSE(fs::exists(fs::symlink_status(scratch / name))) << name;
  EXPECT_EQ(contents_of(scratch / "out/mine.png"), "text");
  const std::string later = scratch.file("out/v1.png", "a user's");
  const auto taken = check_free(own);
  ASSERT_FALSE(taken) << "the last run wrote none";
  EXPECT_EQ(taken.error().what.rfind(later + ": ", 0), 0U) << taken.error().what;
}

}  // namespace
}  // namespace birdseye::hw_sim
