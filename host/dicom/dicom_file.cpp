#include "host/dicom/dicom_file.hpp"

#include <dcmtk/dcmdata/dcuid.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>

#include "host/dicom/dicom_dataset.hpp"
#include "host/dicom/refused.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr int kMostFrames = 100000;  // of one file

struct KeyTag {
  const char* name;
  DcmTagKey tag;
  const char* unit = "";
};

/// By SliceKey.
const std::array<KeyTag, kSliceKeys>& key_tags() {
  static const std::array<KeyTag, kSliceKeys> tags{{
      {"temporal position", DCM_TemporalPositionIdentifier},
      {"contrast phase", DCM_ContrastBolusAgentPhase},
      {"description", DCM_SeriesDescription},
      {"stack", DCM_StackID},
      {"acquisition", DCM_AcquisitionNumber},
      {"trigger time", DCM_TriggerTime, " ms"},
      {"phase of the heart", DCM_NominalPercentageOfCardiacPhase, " %"},
      {"comments", DCM_ImageComments},
      {"image type", DCM_ImageType},
      {"kernel", DCM_ConvolutionKernel},
      {"kVp", DCM_KVP},
      {"acquisition time", DCM_AcquisitionTime},
      {"content time", DCM_ContentTime},
  }};
  return tags;
}

/// Where the enhanced objects keep what the older ones keep under another tag.
DcmTagKey enhanced_tag(SliceKey key) {
  switch (key) {
    case SliceKey::temporal_position:
      return DCM_TemporalPositionIndex;
    case SliceKey::acquisition:
      return DCM_FrameAcquisitionNumber;
    case SliceKey::trigger_time_ms:
      return DCM_NominalCardiacTriggerDelayTime;
    case SliceKey::comments:
      return DCM_FrameComments;
    case SliceKey::image_type:
      return DCM_FrameType;
    case SliceKey::acquisition_time:
      return DCM_FrameAcquisitionDateTime;
    default:
      return key_tags()[static_cast<std::size_t>(key)].tag;
  }
}

/// What is missing for pixels to be Hounsfield units at a place; empty where nothing is.
std::string read_place_and_scale(const FrameElements& elements, DicomSlice& slice) {
  const auto spacing = elements.numbers(DCM_PixelSpacing);
  if (spacing.size() != 2 || !(spacing[0] > 0) || !(spacing[1] > 0))
    return "has no sound Pixel Spacing (0028,0030); export it again";
  const auto place = elements.numbers(DCM_ImagePositionPatient);
  if (place.size() != 3) return "has no sound Image Position (0020,0032); export it again";
  const auto axes = elements.numbers(DCM_ImageOrientationPatient);
  constexpr const char* kNoAxes = "has no sound Image Orientation (0020,0037); export it again";
  if (axes.size() != 6) return kNoAxes;
  slice.spacing_mm = {spacing[1], spacing[0]};  // of a file: between rows, between columns
  slice.position_mm = {place[0], place[1], place[2]};
  slice.row = {axes[0], axes[1], axes[2]};
  slice.column = {axes[3], axes[4], axes[5]};
  if (std::abs(slice.row.norm() - 1) > 0.01 || std::abs(slice.column.norm() - 1) > 0.01 ||
      std::abs(slice.row.dot(slice.column)) > 0.01) {
    return kNoAxes;
  }
  // Files round these numbers: the axes of what is read are at right angles.
  slice.row.normalize();
  slice.column = (slice.column - slice.column.dot(slice.row) * slice.row).normalized();
  const auto thickness = elements.numbers(DCM_SliceThickness);
  if (!thickness.empty() && thickness[0] > 0) slice.thickness_mm = thickness[0];
  const auto between = elements.numbers(DCM_SpacingBetweenSlices);
  if (!between.empty() && std::isfinite(between[0])) slice.between_mm = std::abs(between[0]);
  for (const auto& [tag, value] :
       {std::pair{DCM_RescaleIntercept, &slice.intercept}, std::pair{DCM_RescaleSlope, &slice.slope}}) {
    const auto numbers = elements.numbers(tag);
    if (elements.has(tag) && numbers.size() != 1)
      return "has no sound Rescale Intercept and Slope (0028,1052); export it again";
    if (numbers.size() == 1) *value = numbers[0];
    slice.scaled = slice.scaled && numbers.size() == 1;
  }
  if (!(slice.slope > 0)) return "has no sound Rescale Intercept and Slope (0028,1052); export it again";
  return {};
}

void read_keys(DcmDataset& dataset, const FrameElements& elements, DicomSlice& slice) {
  slice.unit = words_of(dataset, elements.text(DCM_RescaleType));
  for (std::size_t k = 0; k < kSliceKeys; ++k) {
    std::string text = elements.text(enhanced_tag(static_cast<SliceKey>(k)));
    if (text.empty()) text = elements.text(key_tags()[k].tag);
    slice.keys[k] = words_of(dataset, text);
  }
}

/// Whether the file has all of its pixels, which are its last element or nearly so, and none beyond them. spare_bytes:
/// how many bytes more are padding. Empty, or what is wrong.
std::string wrong_pixel_bytes(DcmDataset& dataset, const fs::path& path, std::size_t pixel_bytes,
                              std::size_t spare_bytes) {
  DcmElement* element = nullptr;
  if (dataset.findAndGetElement(DCM_PixelData, element).bad() || element == nullptr)
    return "holds no pixels; copy it again";
  auto* const pixels = dynamic_cast<DcmPixelData*>(element);
  if (pixels == nullptr) return "holds no pixels that can be read; export it again";
  if (DcmXfer(dataset.getOriginalXfer()).isEncapsulated())
    return {};  // a sequence that ends, or it had not been loaded; DicomPixels holds its size against the header
  std::error_code error;
  const auto file_bytes = fs::file_size(path, error);
  const bool deflated = dataset.getOriginalXfer() == EXS_DeflatedLittleEndianExplicit;
  const std::size_t has = pixels->getLength(dataset.getOriginalXfer());
  if (has < pixel_bytes || (!deflated && (error || file_bytes < has))) return "is cut short; copy it again";
  if (has > pixel_bytes + spare_bytes) {
    return fmt::format(
        "has {} bytes of pixels where its Rows, Columns, Bits Allocated and Number of Frames say {}; export it again",
        has, pixel_bytes);
  }
  return {};
}

/// Whether the decoders know how the pixels are stored. A syntax that DCMTK has no name for it takes for explicit
/// little-endian, as the headers of all newer ones are.
bool is_read(const DicomFile& file, E_TransferSyntax syntax) {
  if (!file.named_syntax) return false;
  switch (syntax) {
    case EXS_JPEGProcess1:
    case EXS_JPEGProcess2_4:
    case EXS_JPEGProcess6_8:
    case EXS_JPEGProcess10_12:
    case EXS_JPEGProcess14:
    case EXS_JPEGProcess14SV1:
    case EXS_JPEGLSLossless:
    case EXS_JPEGLSLossy:
    case EXS_JPEG2000LosslessOnly:
    case EXS_JPEG2000:
    case EXS_RLELossless:
      return true;
    default:
      return !DcmXfer(syntax).isEncapsulated() && syntax != EXS_JPIPReferenced && syntax != EXS_JPIPReferencedDeflate;
  }
}

/// The number of frames, or 0 where it makes no sense.
int frame_count(DcmDataset& dataset) {
  if (text_of(dataset, DCM_NumberOfFrames).empty()) return 1;
  const auto frames = integer_of(dataset, DCM_NumberOfFrames);
  return frames && *frames > 0 && *frames <= kMostFrames ? *frames : 0;
}

/// Fills file.slices, or says why not.
std::string read_slices(DcmDataset& dataset, DicomFile& file) {
  const int rows = integer_of(dataset, DCM_Rows).value_or(0), columns = integer_of(dataset, DCM_Columns).value_or(0);
  if (rows < 1 || columns < 1 || rows > kMostPixels || columns > kMostPixels)
    return fmt::format("says it has {} x {} pixels, which no CT has; export it again", columns, rows);
  if (file.modality != "CT") return fmt::format("is of modality '{}'; give a series of modality CT", file.modality);
  if (integer_of(dataset, DCM_SamplesPerPixel).value_or(1) != 1)
    return "is a colour picture; give the series that it was made from";
  if (!is_read(file, dataset.getOriginalXfer())) {
    return fmt::format("is compressed in the syntax {}, which is not read; export it again, uncompressed", file.syntax);
  }
  const int bits = integer_of(dataset, DCM_BitsAllocated).value_or(0);
  if (bits != 8 && bits != 16) return fmt::format("has pixels of {} bits where a CT has 16; export it again", bits);
  const int frames = frame_count(dataset);
  if (frames == 0) return "says it has a number of frames that makes no sense; export it again";
  const auto own = items_of(dataset, DCM_PerFrameFunctionalGroupsSequence);
  if (frames > 1 && own.empty())
    return "holds several frames without their places; give a series of one slice a file, or an enhanced CT";
  if (!own.empty() && own.size() != static_cast<std::size_t>(frames)) {
    return fmt::format("says it has {} frames, and has the places of {}; export it again", frames, own.size());
  }
  if (text_of(dataset, DCM_PhotometricInterpretation) != "MONOCHROME2")
    return "is not MONOCHROME2, as a CT is; export it again";
  const auto wide = static_cast<std::size_t>(columns), high = static_cast<std::size_t>(rows),
             bytes_each = static_cast<std::size_t>(bits / 8);
  const std::size_t pixel_bytes = wide * high * static_cast<std::size_t>(frames) * bytes_each;
  // A row or a column more is no padding: of a picture that small, a byte that makes the length even still is.
  const std::size_t spare_bytes = std::max(std::min(wide, high) * bytes_each - 1, std::size_t{1});
  if (std::string wrong = wrong_pixel_bytes(dataset, file.path, pixel_bytes, spare_bytes); !wrong.empty()) return wrong;
  DcmItem* const shared = item_of(dataset, DCM_SharedFunctionalGroupsSequence);
  file.slices.resize(static_cast<std::size_t>(frames));
  for (int i = 0; i < frames; ++i) {
    DicomSlice& slice = file.slices[static_cast<std::size_t>(i)];
    slice.frame = i;
    slice.instance = integer_of(dataset, DCM_InstanceNumber).value_or(0);
    slice.columns = columns;
    slice.rows = rows;
    const FrameElements elements(dataset, own.empty() ? nullptr : own[static_cast<std::size_t>(i)], shared);
    if (std::string fault = read_place_and_scale(elements, slice); !fault.empty()) {
      file.slices.clear();
      return frames == 1 ? fault : fmt::format("frame {} {}", i + 1, fault);
    }
    read_keys(dataset, elements, slice);
  }
  return {};
}

DicomFile::Kind kind_of(DcmDataset& dataset, const std::string& sop_class) {
  if (sop_class == UID_MediaStorageDirectoryStorage || dataset.tagExists(DCM_DirectoryRecordSequence))
    return DicomFile::Kind::directory;
  constexpr std::string_view kLabelMapStorage = "1.2.840.10008.5.1.4.1.1.66.7";  // younger than the library
  if (sop_class == UID_SegmentationStorage || sop_class == kLabelMapStorage || dataset.tagExists(DCM_SegmentSequence))
    return DicomFile::Kind::labels;
  // A file of an image that was cut before its pixels still says how many there should be.
  return dataset.tagExists(DCM_PixelData) || dataset.tagExists(DCM_Rows) ? DicomFile::Kind::slices
                                                                         : DicomFile::Kind::no_image;
}

}  // namespace

std::string slice_key_words(SliceKey key, const std::string& value) {
  const KeyTag& known = key_tags()[static_cast<std::size_t>(key)];
  return value.empty() ? fmt::format("{} none", known.name) : fmt::format("{} {}{}", known.name, value, known.unit);
}

bool begins_as_dicom(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) return false;  // a pipe would be waited for
  std::array<char, 132> head{};
  std::ifstream in(path, std::ios::binary);
  in.read(head.data(), head.size());
  const std::streamsize got = in.gcount();
  if (got == static_cast<std::streamsize>(head.size()) && std::string_view(head.data() + 128, 4) == "DICM") return true;
  // Older files begin with their first element, of group 2 or 8, in either order of bytes.
  const auto byte = [&head](std::size_t i) { return static_cast<unsigned char>(head[i]); };
  const bool little = (byte(0) == 2 || byte(0) == 8) && byte(1) == 0 && byte(3) == 0 && byte(2) <= 0x20;
  const bool big = byte(0) == 0 && (byte(1) == 2 || byte(1) == 8) && byte(2) == 0 && byte(3) <= 0x20;
  return got >= 8 && (little || big);
}

Result<DicomFile> read_dicom_file(const fs::path& path) {
  if (!begins_as_dicom(path)) return refused(Errc::bad_format, path, "is empty, damaged or no DICOM; copy it again");
  std::string twice;
  const auto loaded = load_dicom(path, &twice);
  if (!loaded) return loaded.error();
  DcmDataset& dataset = *(*loaded)->getDataset();
  DicomFile file;
  file.path = path;
  std::string sop_class = text_of(dataset, DCM_SOPClassUID);
  if (sop_class.empty()) sop_class = text_of(*(*loaded)->getMetaInfo(), DCM_MediaStorageSOPClassUID);
  file.series_uid = text_of(dataset, DCM_SeriesInstanceUID);
  file.kind = kind_of(dataset, sop_class);
  // Anonymisers leave out the identifiers; what begins as text may pass for elements, but not for these.
  if (file.kind == DicomFile::Kind::no_image && sop_class.empty() && text_of(dataset, DCM_Modality).empty())
    return refused(Errc::bad_format, path, "is empty, damaged or no DICOM; copy it again");
  const char* name = dcmFindNameOfUID(sop_class.c_str());
  file.what = name == nullptr ? words_of(dataset, sop_class) : name;
  if (file.kind == DicomFile::Kind::directory) return file;
  const auto words = [&dataset](const DcmTagKey& tag) { return words_of(dataset, text_of(dataset, tag)); };
  file.instance_uid = text_of(dataset, DCM_SOPInstanceUID);
  file.frame_of_reference_uid = text_of(dataset, DCM_FrameOfReferenceUID);
  file.modality = words(DCM_Modality);
  file.description = words(DCM_SeriesDescription);
  if (file.description.empty()) file.description = words(DCM_ProtocolName);
  for (const DcmTagKey& tag : {DCM_SeriesDate, DCM_AcquisitionDate, DCM_ContentDate, DCM_StudyDate}) {
    if (file.date.empty()) file.date = words(tag).substr(0, 8);
  }
  for (const DcmTagKey& tag : {DCM_AcquisitionTime, DCM_SeriesTime, DCM_ContentTime}) {
    if (file.time.empty()) file.time = words(tag).substr(0, 6);
  }
  file.patient.name = person_name(words(DCM_PatientName));
  file.patient.id = words(DCM_PatientID);
  file.patient.birth_date = dashed_date(words(DCM_PatientBirthDate));
  for (const DcmTagKey& tag : {DCM_AcquisitionDate, DCM_SeriesDate, DCM_StudyDate, DCM_ContentDate}) {
    if (file.patient.ct_date.empty()) file.patient.ct_date = dashed_date(words(tag));
  }
  file.agent = words(DCM_ContrastBolusAgent);
  if (DcmItem* const agent = item_of(dataset, DCM_ContrastBolusAgentSequence); file.agent.empty() && agent != nullptr)
    file.agent = words_of(dataset, text_of(*agent, DCM_CodeMeaning));
  file.series_number = integer_of(dataset, DCM_SeriesNumber);
  file.columns = std::max(0, integer_of(dataset, DCM_Columns).value_or(0));
  file.rows = std::max(0, integer_of(dataset, DCM_Rows).value_or(0));
  file.frames = file.rows > 0 ? frame_count(dataset) : 0;
  const DcmXfer syntax(dataset.getOriginalXfer());
  file.syntax = syntax.getXferName();
  const std::string syntax_uid = text_of(*(*loaded)->getMetaInfo(), DCM_TransferSyntaxUID);
  if (!syntax_uid.empty() && DcmXfer(syntax_uid.c_str()).getXfer() == EXS_Unknown) {
    file.syntax = words_of(dataset, syntax_uid);
    file.named_syntax = false;
  }
  file.compressed = syntax.isEncapsulated();
  file.of_ct_class = sop_class.empty() || sop_class == UID_CTImageStorage || sop_class == UID_EnhancedCTImageStorage ||
                     sop_class == UID_LegacyConvertedEnhancedCTImageStorage;
  const std::string type = text_of(dataset, DCM_ImageType);
  file.localizer = type.find("LOCALIZER") != std::string::npos || type.find("SCOUT") != std::string::npos;
  if (file.kind == DicomFile::Kind::slices) file.fault = twice.empty() ? read_slices(dataset, file) : twice;
  return file;
}

}  // namespace birdseye::host
