#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/dicom_files.hpp"

namespace birdseye::testing {

/// A frame of a segmentation of 5 x 3 pixels: 15 bits, so that frames do not begin at whole bytes.
struct SegFrame {
  int segment = 1;
  Eigen::Vector3d place_mm{0, 0, 0};
  std::vector<int> pixels;  ///< along rows
};

inline constexpr int kSegColumns = 5, kSegRows = 3;

struct Segmentation {
  std::string type = "BINARY";
  std::vector<std::string> names{"Liver", "Portal vein"};
  std::vector<SegFrame> frames;
  std::string axes = "1\\0\\0\\0\\1\\0";
};

inline void put_seg_pixels(DcmDataset& dataset, const Segmentation& seg) {
  const bool bits = seg.type == "BINARY";
  put(dataset, DCM_SamplesPerPixel, 1);
  put(dataset, DCM_PhotometricInterpretation, "MONOCHROME2");
  put(dataset, DCM_Rows, kSegRows);
  put(dataset, DCM_Columns, kSegColumns);
  put(dataset, DCM_BitsAllocated, bits ? 1 : 8);
  put(dataset, DCM_BitsStored, bits ? 1 : 8);
  put(dataset, DCM_HighBit, bits ? 0 : 7);
  put(dataset, DCM_PixelRepresentation, 0);
  std::vector<Uint8> bytes;
  std::size_t at = 0;
  for (const SegFrame& frame : seg.frames) {
    for (const int pixel : frame.pixels) {
      if (!bits) {
        bytes.push_back(static_cast<Uint8>(pixel));
        continue;
      }
      if (at % 8 == 0) bytes.push_back(0);
      if (pixel != 0) bytes.back() = static_cast<Uint8>(bytes.back() | 1U << at % 8);
      ++at;
    }
  }
  if (bytes.size() % 2 != 0) bytes.push_back(0);
  EXPECT_TRUE(dataset.putAndInsertUint8Array(DCM_PixelData, bytes.data(), bytes.size()).good());
}

/// more: sets further elements, or others.
inline void write_segmentation(const std::filesystem::path& path, const Segmentation& seg, const Elements& more = {},
                               E_TransferSyntax syntax = EXS_LittleEndianExplicit) {
  DcmFileFormat file;
  DcmDataset& dataset = *file.getDataset();
  put_object(dataset, UID_SegmentationStorage, "2.25.60", 60, 1, "SEG");
  put(dataset, DCM_SegmentationType, seg.type);
  if (seg.type == "FRACTIONAL") put(dataset, DCM_MaximumFractionalValue, 200);
  put(dataset, DCM_NumberOfFrames, std::to_string(seg.frames.size()));
  for (std::size_t i = 0; i < seg.names.size(); ++i) {
    DcmItem& segment = add_item(dataset, DCM_SegmentSequence);
    put(segment, DCM_SegmentNumber, static_cast<int>(i) + 1);
    put(segment, DCM_SegmentLabel, seg.names[i]);
  }
  DcmItem& shared = add_item(dataset, DCM_SharedFunctionalGroupsSequence);
  DcmItem& measures = add_item(shared, DCM_PixelMeasuresSequence);
  put(measures, DCM_PixelSpacing, "0.75\\0.5");
  put(measures, DCM_SliceThickness, "2");
  put(measures, DCM_SpacingBetweenSlices, "2");
  put(add_item(shared, DCM_PlaneOrientationSequence), DCM_ImageOrientationPatient, seg.axes);
  for (const SegFrame& frame : seg.frames) {
    DcmItem& own = add_item(dataset, DCM_PerFrameFunctionalGroupsSequence);
    put(add_item(own, DCM_PlanePositionSequence), DCM_ImagePositionPatient, numbers(frame.place_mm));
    if (frame.segment > 0)
      put(add_item(own, DCM_SegmentIdentificationSequence), DCM_ReferencedSegmentNumber, frame.segment);
  }
  put_seg_pixels(dataset, seg);
  if (more) more(dataset);
  save_dicom(file, path, syntax);
}

}  // namespace birdseye::testing
