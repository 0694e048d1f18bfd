#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <functional>
#include <string>

#include "host/volume/import.hpp"
#include "tests/support/dicom_files.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;

using testing::CtSlice;
using testing::put;
using testing::Scratch;
using testing::write_ct_series;
using testing::write_ct_slice;

/// Four slices every 2 mm, in files 1.dcm to 4.dcm, each with what `more` sets.
void write_four(const fs::path& folder, const std::function<void(DcmDataset&, int k)>& more) {
  CtSlice slice;
  for (int k = 0; k < 4; ++k) {
    write_ct_slice(folder / fmt::format("{}.dcm", slice.instance), slice,
                   [&](DcmDataset& dataset) { more(dataset, k); });
    slice.instance += 1;
    slice.first += 100;
    slice.place_mm.z() += 2;
  }
}

std::string notes_of(const fs::path& folder) {
  const auto read = import_with_notes(folder);
  EXPECT_TRUE(read) << read.error().what;
  std::string notes;
  if (!read) return notes;
  for (const std::string& note : read->notes) notes += note + "\n";
  return notes;
}

TEST(DicomDoubts, OfTwoDistancesOfSlicesThoseOfTheirPositionsCountAndItIsSaid) {
  const Scratch scratch;
  const auto said = [](const char* mm) {
    return [mm](DcmDataset& dataset) { put(dataset, DCM_SpacingBetweenSlices, mm); };
  };
  write_ct_series(scratch / "right", {}, 4, said("2.0"));
  write_ct_series(scratch / "down", {}, 4, said("-2.0"));
  write_ct_series(scratch / "wrong", {}, 4, said("5"));
  EXPECT_EQ(notes_of(scratch / "right"), "");
  EXPECT_EQ(notes_of(scratch / "down"), "");
  EXPECT_NE(notes_of(scratch / "wrong").find("5 mm by Spacing Between Slices (0018,0088), 2 mm by their positions"),
            std::string::npos);
  EXPECT_EQ(import_volume(scratch / "wrong")->spacing_mm.z(), 2);
}

TEST(DicomDoubts, SlicesOfTwoFramesOfReferenceAreNoVolume) {
  const Scratch scratch;
  write_four(scratch / "one", [](DcmDataset& dataset, int) { put(dataset, DCM_FrameOfReferenceUID, "2.25.8"); });
  write_four(scratch / "two",
             [](DcmDataset& dataset, int k) { put(dataset, DCM_FrameOfReferenceUID, k < 2 ? "2.25.8" : "2.25.9"); });
  EXPECT_TRUE(import_volume(scratch / "one"));
  const auto two = import_volume(scratch / "two");
  ASSERT_FALSE(two);
  EXPECT_NE(two.error().what.find("of 2 frames of reference (0020,0052), as 2.25.8 and 2.25.9"), std::string::npos)
      << two.error().what;
  VolumeSource untilted(scratch / "two");
  untilted.untilt = true;
  EXPECT_FALSE(import_volume(untilted));
}

/// Behind all of a file's elements, explicit and little-endian, one more of text.
void append_element(const fs::path& path, std::uint16_t group, std::uint16_t element, const std::string& vr,
                    const std::string& value) {
  std::ofstream out(path, std::ios::binary | std::ios::app);
  for (const std::size_t number : {std::size_t{group}, std::size_t{element}})
    out << static_cast<char>(number & 0xFFU) << static_cast<char>(number >> 8U);
  out << vr << static_cast<char>(value.size()) << '\0' << value;
}

/// Of such an element DCMTK reads the first, other programs the last.
TEST(DicomDoubts, AnElementThatStandsTwiceIsRefusedByItsTag) {
  const Scratch scratch;
  write_four(scratch / "ct", [](DcmDataset&, int) {});
  const fs::path slice = scratch / "ct/2.dcm";
  for (int n = 0; n < 2; ++n) append_element(slice, 0x7FE1, 0x0010, "LO", "a maker's own ");
  EXPECT_TRUE(import_volume(scratch / "ct")) << "what a maker adds is not read";
  append_element(slice, 0x0020, 0x0032, "DS", "0\\0\\500 ");
  for (const fs::path& given : {slice, fs::path(scratch / "ct")}) {
    const auto twice = import_volume(given);
    ASSERT_FALSE(twice) << given;
    EXPECT_NE(twice.error().what.find("2.dcm: has (0020,0032) twice; export it again"), std::string::npos)
        << twice.error().what;
  }
}

TEST(DicomDoubts, EachSliceHasItsOwnScale) {
  const Scratch scratch;
  write_four(scratch / "ct", [](DcmDataset& dataset, int k) {
    put(dataset, DCM_RescaleIntercept, fmt::format("{}", -1000 - 10 * k));
    put(dataset, DCM_RescaleSlope, k == 3 ? "2" : "1");
  });
  const auto ct = import_volume(scratch / "ct");
  ASSERT_TRUE(ct) << ct.error().what;
  EXPECT_EQ(ct->at(1, 0, 0), 1001 - 1000);
  EXPECT_EQ(ct->at(1, 0, 1), 1101 - 1010);
  EXPECT_EQ(ct->at(1, 0, 3), 2 * 1301 - 1030);
}

TEST(DicomDoubts, ValuesThatMayBeNoHounsfieldUnitsAreSaidToBe) {
  const Scratch scratch;
  for (const DcmTagKey& tag : {DCM_RescaleIntercept, DCM_RescaleSlope}) {
    const fs::path folder = scratch / DcmTag(tag).getTagName();
    write_four(folder, [&](DcmDataset& dataset, int) { EXPECT_TRUE(dataset.findAndDeleteElement(tag).good()); });
    EXPECT_NE(notes_of(folder).find("lack Rescale Intercept or Slope"), std::string::npos) << folder;
  }
  write_ct_series(scratch / "hu", {}, 4, [](DcmDataset& dataset) { put(dataset, DCM_RescaleType, "HU"); });
  EXPECT_EQ(notes_of(scratch / "hu"), "");
  write_ct_series(scratch / "us", {}, 4, [](DcmDataset& dataset) { put(dataset, DCM_RescaleType, "US"); });
  EXPECT_EQ(notes_of(scratch / "us"), "");
  write_ct_series(scratch / "od", {}, 4, [](DcmDataset& dataset) { put(dataset, DCM_RescaleType, "OD"); });
  EXPECT_NE(notes_of(scratch / "od").find("Rescale Type (0028,1054) is OD"), std::string::npos);
  // Beside slices that have it, what a slice without it holds is not known.
  write_four(scratch / "some", [](DcmDataset& dataset, int k) {
    if (k == 2) {
      EXPECT_TRUE(dataset.findAndDeleteElement(DCM_RescaleIntercept).good());
    }
  });
  const auto some = import_volume(scratch / "some");
  ASSERT_FALSE(some);
  EXPECT_NE(some.error().what.find("3.dcm: lacks Rescale Intercept"), std::string::npos) << some.error().what;
}

}  // namespace
}  // namespace birdseye::host
