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

}  // namespace
}  // namespace birdseye::host
