#pragma once

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcrleerg.h>
#include <dcmtk/dcmdata/dctk.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace birdseye::testing {

/// Sets further elements of a file before it is written.
using Elements = std::function<void(DcmDataset&)>;

inline void put(DcmItem& item, const DcmTagKey& tag, const std::string& value) {
  EXPECT_TRUE(item.putAndInsertString(tag, value.c_str()).good()) << value;
}
inline void put(DcmItem& item, const DcmTagKey& tag, int value) {
  EXPECT_TRUE(item.putAndInsertUint16(tag, static_cast<Uint16>(value)).good());
}
inline std::string numbers(const Eigen::VectorXd& v) {
  std::string text;
  for (const double x : v) text += fmt::format("{}{:.6g}", text.empty() ? "" : "\\", x);
  return text;
}

inline void save_dicom(DcmFileFormat& file, const std::filesystem::path& path,
                       E_TransferSyntax syntax = EXS_LittleEndianExplicit) {
  std::filesystem::create_directories(path.parent_path());
  DcmRLEEncoderRegistration::registerCodecs();
  EXPECT_TRUE(file.getDataset()->chooseRepresentation(syntax, nullptr).good()) << path;
  EXPECT_TRUE(file.saveFile(path.c_str(), syntax).good()) << path;
}

/// A slice of a CT of 4 x 3 pixels of 0.5 x 0.75 mm, whose stored values count up from `first`; HU are 1000 less.
struct CtSlice {
  std::string series = "2.25.1";
  int number = 1, instance = 1, first = 1000;
  Eigen::Vector3d place_mm{0, 0, 0};
  std::string description = "abdomen";
};

inline constexpr int kSliceColumns = 4, kSliceRows = 3;

inline void put_pixels(DcmDataset& dataset, int columns, int rows, const std::vector<Uint16>& pixels) {
  put(dataset, DCM_SamplesPerPixel, 1);
  put(dataset, DCM_PhotometricInterpretation, "MONOCHROME2");
  put(dataset, DCM_Rows, rows);
  put(dataset, DCM_Columns, columns);
  put(dataset, DCM_BitsAllocated, 16);
  put(dataset, DCM_BitsStored, 16);
  put(dataset, DCM_HighBit, 15);
  put(dataset, DCM_PixelRepresentation, 0);
  EXPECT_TRUE(dataset.putAndInsertUint16Array(DCM_PixelData, pixels.data(), pixels.size()).good());
}

/// An object of a class and series, without anything else.
inline void put_object(DcmDataset& dataset, const char* sop_class, const std::string& series, int number, int instance,
                       const std::string& modality) {
  put(dataset, DCM_SOPClassUID, sop_class);
  put(dataset, DCM_SOPInstanceUID, fmt::format("{}.{}", series, instance));
  put(dataset, DCM_StudyInstanceUID, "2.25.99");
  put(dataset, DCM_SeriesInstanceUID, series);
  put(dataset, DCM_SeriesNumber, std::to_string(number));
  put(dataset, DCM_InstanceNumber, std::to_string(instance));
  put(dataset, DCM_Modality, modality);
  put(dataset, DCM_SeriesDate, "20210503");
}

inline void write_ct_slice(const std::filesystem::path& path, const CtSlice& slice, const Elements& more = {},
                           E_TransferSyntax syntax = EXS_LittleEndianExplicit) {
  DcmFileFormat file;
  DcmDataset& dataset = *file.getDataset();
  put_object(dataset, UID_CTImageStorage, slice.series, slice.number, slice.instance, "CT");
  put(dataset, DCM_SeriesDescription, slice.description);
  put(dataset, DCM_ImageType, "ORIGINAL\\PRIMARY\\AXIAL");
  put(dataset, DCM_PixelSpacing, "0.75\\0.5");
  put(dataset, DCM_ImagePositionPatient, numbers(slice.place_mm));
  put(dataset, DCM_ImageOrientationPatient, "1\\0\\0\\0\\1\\0");
  put(dataset, DCM_SliceThickness, "2");
  put(dataset, DCM_RescaleIntercept, "-1000");
  put(dataset, DCM_RescaleSlope, "1");
  std::vector<Uint16> pixels;
  for (int i = 0; i < kSliceColumns * kSliceRows; ++i) pixels.push_back(static_cast<Uint16>(slice.first + i));
  put_pixels(dataset, kSliceColumns, kSliceRows, pixels);
  if (more) more(dataset);
  save_dicom(file, path, syntax);
}

/// Slices every 2 mm along z, in files 1.dcm, 2.dcm, ...; their values begin at slice.first, 100 higher in each.
inline void write_ct_series(const std::filesystem::path& folder, CtSlice slice, int count, const Elements& more = {},
                            E_TransferSyntax syntax = EXS_LittleEndianExplicit) {
  for (int k = 0; k < count; ++k) {
    write_ct_slice(folder / fmt::format("{}.dcm", slice.instance), slice, more, syntax);
    slice.instance += 1;
    slice.first += 100;
    slice.place_mm.z() += 2;
  }
}

/// A file of no image: a report, a presentation state, a document.
inline void write_no_image(const std::filesystem::path& path, const char* sop_class, const std::string& modality,
                           int number) {
  DcmFileFormat file;
  put_object(*file.getDataset(), sop_class, fmt::format("2.25.7{}", number), number, 1, modality);
  if (std::string(sop_class) == UID_EncapsulatedPDFStorage) {
    const std::string pdf = "%PDF-1.4 of nothing ";
    EXPECT_TRUE(file.getDataset()
                    ->putAndInsertUint8Array(DCM_EncapsulatedDocument, reinterpret_cast<const Uint8*>(pdf.data()),
                                             pdf.size() / 2 * 2)
                    .good());
  }
  save_dicom(file, path);
}

inline void put_offset(DcmItem& item, const DcmTagKey& tag, Uint32 bytes) {
  auto* const offset = new DcmUnsignedLongOffset(tag);
  EXPECT_TRUE(offset->putUint32(bytes).good());
  EXPECT_TRUE(item.insert(offset).good());
}

/// A directory of a medium, with a record that says that the next one is itself.
inline void write_directory_file(const std::filesystem::path& path) {
  DcmFileFormat file;
  put(*file.getMetaInfo(), DCM_MediaStorageSOPClassUID, UID_MediaStorageDirectoryStorage);
  put(*file.getMetaInfo(), DCM_MediaStorageSOPInstanceUID, "2.25.4711");
  DcmDataset& dataset = *file.getDataset();
  put(dataset, DCM_FileSetID, "EXPORT");
  put_offset(dataset, DCM_OffsetOfTheFirstDirectoryRecordOfTheRootDirectoryEntity, 400);
  put_offset(dataset, DCM_OffsetOfTheLastDirectoryRecordOfTheRootDirectoryEntity, 400);
  EXPECT_TRUE(dataset.putAndInsertUint16(DCM_FileSetConsistencyFlag, 0).good());
  DcmItem* record = nullptr;
  EXPECT_TRUE(dataset.findOrCreateSequenceItem(DCM_DirectoryRecordSequence, record, -2).good());
  put_offset(*record, DCM_OffsetOfTheNextDirectoryRecord, 400);
  put_offset(*record, DCM_OffsetOfReferencedLowerLevelDirectoryEntity, 400);
  put(*record, DCM_DirectoryRecordType, "PATIENT");
  std::filesystem::create_directories(path.parent_path());
  EXPECT_TRUE(file.saveFile(path.c_str(), EXS_LittleEndianExplicit, EET_UndefinedLength, EGL_recalcGL,
                            EPD_withoutPadding, 0, 0, EWM_dontUpdateMeta)
                  .good());
}

/// An item appended to a sequence.
inline DcmItem& add_item(DcmItem& item, const DcmTagKey& sequence) {
  DcmItem* added = nullptr;
  EXPECT_TRUE(item.findOrCreateSequenceItem(sequence, added, -2).good());
  return *added;
}

/// A frame of an enhanced CT of 4 x 3 pixels; its stored values count up from `first`.
struct CtFrame {
  Eigen::Vector3d place_mm{0, 0, 0};
  int first = 1000;
  double intercept = -1000, slope = 1;
  int temporal = 1;
};

/// An enhanced CT of these frames, in their order: places and scales per frame, orientation and spacing shared.
inline void write_enhanced_ct(const std::filesystem::path& path, const std::vector<CtFrame>& frames,
                              const Elements& more = {}, E_TransferSyntax syntax = EXS_LittleEndianExplicit) {
  DcmFileFormat file;
  DcmDataset& dataset = *file.getDataset();
  put_object(dataset, UID_EnhancedCTImageStorage, "2.25.50", 5, 1, "CT");
  put(dataset, DCM_ImageType, "ORIGINAL\\PRIMARY\\VOLUME\\NONE");
  put(dataset, DCM_NumberOfFrames, std::to_string(frames.size()));
  DcmItem& shared = add_item(dataset, DCM_SharedFunctionalGroupsSequence);
  DcmItem& measures = add_item(shared, DCM_PixelMeasuresSequence);
  put(measures, DCM_PixelSpacing, "0.75\\0.5");
  put(measures, DCM_SliceThickness, "2");
  put(add_item(shared, DCM_PlaneOrientationSequence), DCM_ImageOrientationPatient, "1\\0\\0\\0\\1\\0");
  std::vector<Uint16> pixels;
  for (const CtFrame& frame : frames) {
    DcmItem& own = add_item(dataset, DCM_PerFrameFunctionalGroupsSequence);
    DcmItem& content = add_item(own, DCM_FrameContentSequence);
    put(content, DCM_StackID, "1");
    EXPECT_TRUE(content.putAndInsertUint32(DCM_TemporalPositionIndex, static_cast<Uint32>(frame.temporal)).good());
    put(add_item(own, DCM_PlanePositionSequence), DCM_ImagePositionPatient, numbers(frame.place_mm));
    DcmItem& scale = add_item(own, DCM_PixelValueTransformationSequence);
    put(scale, DCM_RescaleIntercept, fmt::format("{:g}", frame.intercept));
    put(scale, DCM_RescaleSlope, fmt::format("{:g}", frame.slope));
    put(scale, DCM_RescaleType, "HU");
    for (int i = 0; i < kSliceColumns * kSliceRows; ++i) pixels.push_back(static_cast<Uint16>(frame.first + i));
  }
  put_pixels(dataset, kSliceColumns, kSliceRows, pixels);
  if (more) more(dataset);
  save_dicom(file, path, syntax);
}

}  // namespace birdseye::testing
