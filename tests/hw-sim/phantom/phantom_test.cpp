#include "hw-sim/phantom/phantom.hpp"

#include <gtest/gtest.h>

#include "hw-sim/phantom/dicom_series.hpp"
#include "hw-sim/phantom/grid.hpp"
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

}  // namespace
}  // namespace birdseye::hw_sim
