#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmjpeg/djencode.h>
#include <dcmtk/dcmjpls/djencode.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <functional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

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

/// Writes a number of two bytes of group 0028 over the one that an explicit, little-endian file has, whose pixels stay.
void say(const fs::path& path, std::uint16_t element, int number) {
  std::string bytes = testing::contents_of(path);
  const std::string head{'\x28', '\0', static_cast<char>(element & 0xFFU), static_cast<char>(element >> 8U), 'U', 'S',
                         '\2',   '\0'};
  const std::size_t at = bytes.find(head);
  ASSERT_NE(at, std::string::npos) << element;
  bytes[at + head.size()] = static_cast<char>(number);
  bytes[at + head.size() + 1] = '\0';
  std::ofstream(path, std::ios::binary) << bytes;
}

constexpr std::uint16_t kRows = 0x0010, kColumns = 0x0011, kBitsAllocated = 0x0100;

void expect_wrong_size(const fs::path& folder, const std::string& why) {
  const auto ct = import_volume(folder);
  ASSERT_FALSE(ct) << folder;
  EXPECT_NE(ct.error().what.find(".dcm: " + why), std::string::npos) << ct.error().what;
  EXPECT_NE(ct.error().what.find("export it again"), std::string::npos) << ct.error().what;
}

TEST(DicomDoubts, MorePixelsThanTheHeaderSaysAreRefusedAndPaddingIsNot) {
  const Scratch scratch;
  for (const auto& [element, number, due] :
       {std::tuple{kColumns, 3, 18}, std::tuple{kRows, 2, 16}, std::tuple{kBitsAllocated, 8, 12}}) {
    const fs::path folder = scratch / std::to_string(element);
    write_four(folder, [](DcmDataset&, int) {});
    for (int i = 1; i <= 4; ++i) say(folder / fmt::format("{}.dcm", i), element, number);
    expect_wrong_size(folder, fmt::format("has 24 bytes of pixels where its Rows, Columns, Bits Allocated and Number "
                                          "of Frames say {}",
                                          due));
  }
  write_four(scratch / "padded", [](DcmDataset& dataset, int) {
    const std::vector<Uint16> pixels(testing::kSliceColumns * testing::kSliceRows + 1, 1040);
    ASSERT_TRUE(dataset.putAndInsertUint16Array(DCM_PixelData, pixels.data(), pixels.size()).good());
  });
  const auto padded = import_volume(scratch / "padded");
  ASSERT_TRUE(padded) << padded.error().what;
  EXPECT_EQ(padded->at(3, 2, 3), 40);
}

TEST(DicomDoubts, ACompressedPictureOfAnotherSizeThanTheHeaderSaysIsRefused) {
  DJEncoderRegistration::registerCodecs();
  DJLSEncoderRegistration::registerCodecs();
  for (const auto& [syntax, name] : {std::pair{EXS_RLELossless, "rle"}, std::pair{EXS_JPEGProcess14SV1, "jpeg"},
                                     std::pair{EXS_JPEGLSLossless, "jpeg-ls"}}) {
    const Scratch scratch;
    write_ct_series(scratch / "ct", {}, 3, {}, syntax);
    const auto right = import_volume(scratch / "ct");
    ASSERT_TRUE(right) << name << ": " << right.error().what;
    EXPECT_EQ(right->at(3, 2, 2), 200 + 11) << name;
    const std::string held = syntax == EXS_RLELossless ? "12 pixels" : "4 x 3";
    for (const auto& [element, number, said] : {std::tuple{kRows, 6, "4 x 6"}, std::tuple{kRows, 2, "4 x 2"},
                                                std::tuple{kColumns, 3, "3 x 3"}, std::tuple{kColumns, 5, "5 x 3"}}) {
      const fs::path folder = scratch / said;
      fs::copy(scratch / "ct", folder);
      for (int i = 1; i <= 3; ++i) say(folder / fmt::format("{}.dcm", i), element, number);
      expect_wrong_size(folder,
                        fmt::format("its compressed picture is of {} where its Columns and Rows say {}; ", held, said));
    }
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
