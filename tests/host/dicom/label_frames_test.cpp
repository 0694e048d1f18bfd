#include <gtest/gtest.h>

#include <string>

#include "host/volume/image_file.hpp"
#include "tests/support/dicom_segmentation.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using testing::put;
using testing::Scratch;
using testing::Segmentation;
using testing::write_segmentation;

/// One segment, full, in slices of these heights.
Segmentation stack_of(const std::vector<double>& z_mm) {
  Segmentation seg;
  for (const double z : z_mm) seg.frames.push_back({1, {0, 0, z}, std::vector<int>(15, 1)});
  return seg;
}

/// What is said of a segmentation as a file; empty where it is read.
std::string said_of(const Segmentation& seg, const testing::Elements& more = {}) {
  const Scratch scratch;
  write_segmentation(scratch / "seg.dcm", seg, more);
  const auto labels = read_labels_file(scratch / "seg.dcm");
  if (labels) return {};
  const std::string& what = labels.error().what;
  EXPECT_NE(what.find("seg.dcm: "), std::string::npos) << what;
  EXPECT_EQ(what.find('\n'), std::string::npos) << what;
  return what;
}

void expect_said(const std::string& said, const std::string& words) {
  EXPECT_NE(said.find(words), std::string::npos) << "'" << said << "', and not: " << words;
}

TEST(DicomSegFrames, AreAsManyAsTheFileSays) {
  const Segmentation seg = stack_of({0, 2, 4});
  EXPECT_EQ(said_of(seg), "");
  for (const char* number : {"2", "4", "0", "-5", "2147483647"}) {
    expect_said(said_of(seg, [&](DcmDataset& dataset) { put(dataset, DCM_NumberOfFrames, number); }),
                fmt::format("says it has {} frames, and has the places of 3; export it again", number));
  }
  expect_said(said_of(seg, [](DcmDataset& dataset) { dataset.findAndDeleteElement(DCM_NumberOfFrames); }),
              "does not say how many frames it has (0028,0008)");
}

/// Sets the number of the second of the segments that a file names.
testing::Elements second_segment(const std::string& number) {
  return [number](DcmDataset& dataset) {
    DcmItem* segment = nullptr;
    ASSERT_TRUE(dataset.findAndGetSequenceItem(DCM_SegmentSequence, segment, 1).good());
    ASSERT_TRUE(segment->findAndDeleteElement(DCM_SegmentNumber).good());
    // As a text, whatever it says.
    auto* const text = new DcmIntegerString(DcmTag(DCM_SegmentNumber, EVR_IS));
    ASSERT_TRUE(text->putString(number.c_str()).good());
    ASSERT_TRUE(segment->insert(text).good());
  };
}

TEST(DicomSegFrames, SegmentsHaveWholeNumbersFromOneOnEachItsOwn) {
  const Segmentation seg = stack_of({0, 2});
  EXPECT_EQ(said_of(seg, second_segment("4002")), "") << "numbers may be left out";
  for (const char* number : {"0", "-7", "1.5", "65536", "2147483647", ""}) {
    expect_said(said_of(seg, second_segment(number)),
                fmt::format("has a segment of the number '{}', which is none from 1 to 65535", number));
  }
  expect_said(said_of(seg, second_segment("1")), "has two segments of the number 1 ");
}

TEST(DicomSegFrames, OfALabelMapTheBackgroundMayBeASegment) {
  Segmentation seg = stack_of({0, 2});
  seg.type = "LABELMAP";
  for (auto& frame : seg.frames) frame.segment = 0;
  EXPECT_EQ(said_of(seg, second_segment("0")), "");
  expect_said(said_of(seg, second_segment("-1")), "has a segment of the number '-1'");
  const auto padded = [](int with) {
    return [with, zero = second_segment("0")](DcmDataset& dataset) {
      zero(dataset);
      put(dataset, DCM_PixelPaddingValue, with);
    };
  };
  EXPECT_EQ(said_of(seg, padded(0)), "");
  expect_said(said_of(seg, padded(255)), "has a segment of the number 0 beside a background of 255 (0028,0120)");
}

TEST(DicomSegFrames, OfALabelMapEachVoxelIsOfASegmentThatTheFileHas) {
  Segmentation map = stack_of({0, 2});
  map.type = "LABELMAP";
  for (auto& frame : map.frames) frame.segment = 0;
  map.frames[1].pixels[7] = 2;
  EXPECT_EQ(said_of(map), "");
  map.frames[1].pixels[7] = 3;
  expect_said(said_of(map), "has a voxel of segment 3, which is none of its segments (0062,0002)");
  EXPECT_EQ(said_of(map, [](DcmDataset& dataset) { put(dataset, DCM_PixelPaddingValue, 3); }), "")
      << "the background has the number that the file says";
  expect_said(said_of(map, [](DcmDataset& dataset) { put(dataset, DCM_PixelPaddingValue, 255); }),
              "has a voxel of segment 3");
}

/// Says of the first frame, in its groups or in those of all frames, which segment it is of.
testing::Elements frames_are_of(const std::string& segment, const DcmTagKey& groups) {
  return [segment, groups](DcmDataset& dataset) {
    DcmItem *own = nullptr, *group = nullptr, *identification = nullptr;
    ASSERT_TRUE(dataset.findAndGetSequenceItem(DCM_PerFrameFunctionalGroupsSequence, own, 0).good());
    ASSERT_TRUE(own->findAndDeleteElement(DCM_SegmentIdentificationSequence).good());
    ASSERT_TRUE(dataset.findAndGetSequenceItem(groups, group, 0).good());
    ASSERT_TRUE(group->findOrCreateSequenceItem(DCM_SegmentIdentificationSequence, identification, -2).good());
    auto* const text = new DcmDecimalString(DcmTag(DCM_ReferencedSegmentNumber, EVR_DS));
    ASSERT_TRUE(text->putString(segment.c_str()).good());
    ASSERT_TRUE(identification->insert(text).good());
  };
}

TEST(DicomSegFrames, AreOfASegmentWithAWholeNumber) {
  const Segmentation seg = stack_of({0, 2});
  for (const DcmTagKey& groups : {DCM_PerFrameFunctionalGroupsSequence, DCM_SharedFunctionalGroupsSequence}) {
    EXPECT_EQ(said_of(seg, frames_are_of("2", groups)), "");
    for (const char* number : {"1.5", "0", "-1", "1\\2", "65536", ""})
      expect_said(said_of(seg, frames_are_of(number, groups)), "frame 1 is of no segment; export it again");
  }
}

TEST(DicomSegFrames, TheSegmentsOfImagesThatTheyWereMadeFromAreNotTheirs) {
  EXPECT_EQ(said_of(stack_of({0, 2}),
                    [](DcmDataset& dataset) {
                      DcmItem* own = nullptr;
                      ASSERT_TRUE(dataset.findAndGetSequenceItem(DCM_PerFrameFunctionalGroupsSequence, own, 0).good());
                      DcmItem& derivation = testing::add_item(*own, DCM_DerivationImageSequence);
                      put(testing::add_item(derivation, DCM_SourceImageSequence), DCM_ReferencedSegmentNumber, 9);
                    }),
            "");
}

TEST(DicomSegFrames, AreOfASegmentThatTheFileHas) {
  Segmentation seg = stack_of({0, 2, 4});
  seg.frames[1].segment = 7;
  expect_said(said_of(seg), "frame 2 is of segment 7, which is none of its segments (0062,0002); export it again");
  seg = stack_of({0});
  seg.names.clear();
  expect_said(said_of(seg), "frame 1 is of segment 1, which is none of its segments");
}

TEST(DicomSegFrames, OfOneSegmentHaveEachAPlaceOfTheirOwn) {
  Segmentation seg = stack_of({0, 2, 4, 2});
  expect_said(said_of(seg), "has several frames of segment 1 at 0, 0, 2 mm, of which only one can be meant");
  seg.frames[3].segment = 2;
  EXPECT_EQ(said_of(seg), "") << "segments may share places";
  expect_said(said_of(stack_of({0, 0, 0})), "has several frames of segment 1 at 0, 0, 0 mm");
  expect_said(said_of(stack_of({0, 2, 4, 4.02})), "has several frames of segment 1 at 0, 0, 4.02 mm");
  Segmentation map = stack_of({0, 2, 2});
  map.type = "LABELMAP";
  expect_said(said_of(map), "has several frames at 0, 0, 2 mm");
}

TEST(DicomSegFrames, ThickerThanTheyLieApartAreTwo) {
  const Scratch scratch;
  write_segmentation(scratch / "seg.dcm", stack_of({0, 0.8}), [](DcmDataset& dataset) {
    DcmItem *shared = nullptr, *measures = nullptr;
    ASSERT_TRUE(dataset.findAndGetSequenceItem(DCM_SharedFunctionalGroupsSequence, shared).good());
    ASSERT_TRUE(shared->findAndGetSequenceItem(DCM_PixelMeasuresSequence, measures).good());
    ASSERT_TRUE(measures->findAndDeleteElement(DCM_SpacingBetweenSlices).good());
    put(*measures, DCM_SliceThickness, "5");
  });
  const auto labels = read_labels_file(scratch / "seg.dcm");
  ASSERT_TRUE(labels) << labels.error().what;
  EXPECT_EQ(labels->size[2], 2);
  EXPECT_NEAR(labels->spacing_mm.z(), 0.8, 1e-9);
}

}  // namespace
}  // namespace birdseye::host
