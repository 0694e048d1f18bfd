#include "host/dicom/dicom_labels.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "host/dicom/dicom_dataset.hpp"
#include "host/dicom/refused.hpp"
#include "host/dicom/shared_values.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostLabelVoxels = std::size_t{1} << 31U;

/// Where a frame lies, and which segment it shows; 0: its pixels say.
struct LabelFrame {
  Eigen::Vector3d place_mm;
  int segment = 0;
};

/// How the pixels of all frames are to be taken.
struct LabelPixels {
  int columns = 0, rows = 0;
  int bits = 8;        ///< of a pixel: 1, 8 or 16
  int at_least = 1;    ///< for the pixel to belong to the frame's segment
  int background = 0;  ///< of a label map
  std::vector<std::uint8_t> bytes;

  [[nodiscard]] std::size_t per_frame() const {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  }
  /// The i-th pixel of all. Bits lie packed without gaps between frames, from the lowest of a byte.
  [[nodiscard]] int at(std::size_t i) const {
    if (bits == 1) return bytes[i / 8] >> (i % 8) & 1;
    if (bits == 8) return bytes[i];
    return bytes[2 * i] | bytes[2 * i + 1] << 8;
  }
};

constexpr int kHighestSegment = 65535;

/// The segments that the file has; empty, or what is wrong. by_pixels: one may be the background, as 0.
std::string read_names(DcmDataset& dataset, bool by_pixels, std::vector<NamedLabel>& names) {
  std::set<int> numbers;
  for (DcmItem* segment : items_of(dataset, DCM_SegmentSequence)) {
    const auto number = integer_of(*segment, DCM_SegmentNumber);
    if (!number || *number < (by_pixels ? 0 : 1) || *number > kHighestSegment) {
      return fmt::format("has a segment of the number '{}', which is none from 1 to {} (0062,0004); export it again",
                         words_of(dataset, text_of(*segment, DCM_SegmentNumber).substr(0, 16)), kHighestSegment);
    }
    if (!numbers.insert(*number).second)
      return fmt::format("has two segments of the number {} (0062,0004); export it again", *number);
    NamedLabel label;
    label.number = *number;
    label.name = words_of(dataset, text_of(*segment, DCM_SegmentLabel));
    if (DcmItem* const type = item_of(*segment, DCM_SegmentedPropertyTypeCodeSequence);
        label.name.empty() && type != nullptr) {
      label.name = words_of(dataset, text_of(*type, DCM_CodeMeaning));
    }
    names.push_back(std::move(label));
  }
  return {};
}

/// What a frame's groups, or those that the frames share, say of its segment; 0 where it is no number of one.
int segment_of(DcmItem* own, DcmItem* shared, const FrameElements& elements) {
  std::vector<double> number = elements.numbers(DCM_ReferencedSegmentNumber);
  // An image that the segmentation was made from may be a segmentation, whose segments are not this one's.
  for (DcmItem* group : {shared, own}) {
    DcmItem* const segment = group == nullptr ? nullptr : item_of(*group, DCM_SegmentIdentificationSequence);
    const std::string text = segment == nullptr ? std::string() : text_of(*segment, DCM_ReferencedSegmentNumber);
    if (!text.empty()) number = numbers_in(text);
  }
  const bool sound =
      number.size() == 1 && number[0] >= 1 && number[0] <= kHighestLabel && number[0] == std::floor(number[0]);
  return sound ? static_cast<int>(number[0]) : 0;
}

/// The series of the images that the file refers to, in its own study and in others.
std::vector<std::string> series_referred_to(DcmDataset& dataset) {
  std::vector<DcmItem*> studies = items_of(dataset, DCM_StudiesContainingOtherReferencedInstancesSequence);
  studies.insert(studies.begin(), &dataset);
  std::vector<std::string> uids;
  for (DcmItem* study : studies) {
    for (DcmItem* series : items_of(*study, DCM_ReferencedSeriesSequence)) {
      std::string uid = words_of(dataset, text_of(*series, DCM_SeriesInstanceUID));
      if (!uid.empty()) uids.push_back(std::move(uid));
    }
  }
  return uids;
}

/// The pixels of all frames as they are stored; empty, or why not.
std::string read_pixels(DcmDataset& dataset, int frames, LabelPixels& pixels) {
  pixels.columns = integer_of(dataset, DCM_Columns).value_or(0);
  pixels.rows = integer_of(dataset, DCM_Rows).value_or(0);
  pixels.bits = integer_of(dataset, DCM_BitsAllocated).value_or(0);
  if (pixels.columns < 1 || pixels.rows < 1 || pixels.columns > kMostPixels || pixels.rows > kMostPixels ||
      (pixels.bits != 1 && pixels.bits != 8 && pixels.bits != 16)) {
    return "says it has a size that no segmentation has; export it again";
  }
  if (dataset.chooseRepresentation(EXS_LittleEndianExplicit, nullptr).bad())
    return "is compressed in a way that is not read; export it again, uncompressed";
  const std::size_t bits =
      pixels.per_frame() * static_cast<std::size_t>(frames) * static_cast<std::size_t>(pixels.bits);
  const std::size_t due = (bits + 7) / 8;
  DcmElement* element = nullptr;
  if (dataset.findAndGetElement(DCM_PixelData, element).bad() || element == nullptr || element->getLength() < due)
    return "is cut short; copy it again";
  Uint8* bytes = nullptr;
  Uint16* words = nullptr;
  if (element->getUint8Array(bytes).good() && bytes != nullptr) {
    pixels.bytes.assign(bytes, bytes + due);
  } else if (element->getUint16Array(words).good() && words != nullptr) {
    const auto* const first = reinterpret_cast<const std::uint8_t*>(words);
    pixels.bytes.assign(first, first + due);
  } else {
    return "holds no pixels that can be read; export it again";
  }
  return {};
}

/// Places, segments, spacing and axes, out.names being known; empty, or what is wrong.
std::string read_frames(DcmDataset& dataset, bool by_pixels, DicomLabels& out, std::vector<LabelFrame>& frames) {
  DcmItem* const shared = item_of(dataset, DCM_SharedFunctionalGroupsSequence);
  const auto groups = items_of(dataset, DCM_PerFrameFunctionalGroupsSequence);
  if (groups.empty()) return "has no frames with a place; export it again";
  const auto said = integer_of(dataset, DCM_NumberOfFrames);
  if (!said) return "does not say how many frames it has (0028,0008); export it again";
  if (*said < 1 || static_cast<std::size_t>(*said) != groups.size())
    return fmt::format("says it has {} frames, and has the places of {}; export it again", *said, groups.size());
  std::set<int> numbers;
  for (const NamedLabel& label : out.names) numbers.insert(label.number);
  std::vector<double> axes, spacing, thickness;
  for (DcmItem* own : groups) {
    const FrameElements elements(dataset, own, shared);
    const auto place = elements.numbers(DCM_ImagePositionPatient);
    if (place.size() != 3) return fmt::format("frame {} has no sound place; export it again", frames.size() + 1);
    const int segment = by_pixels ? 0 : segment_of(own, shared, elements);
    if (!by_pixels && segment == 0) return fmt::format("frame {} is of no segment; export it again", frames.size() + 1);
    if (!by_pixels && !numbers.contains(segment)) {
      return fmt::format("frame {} is of segment {}, which is none of its segments (0062,0002); export it again",
                         frames.size() + 1, segment);
    }
    if (frames.empty()) {
      axes = elements.numbers(DCM_ImageOrientationPatient);
      spacing = elements.numbers(DCM_PixelSpacing);
      thickness = elements.numbers(DCM_SpacingBetweenSlices);
      if (thickness.empty()) thickness = elements.numbers(DCM_SliceThickness);
    } else if (elements.numbers(DCM_ImageOrientationPatient) != axes) {
      return "has frames that are turned against one another; export it on the grid of the CT";
    }
    frames.push_back({{place[0], place[1], place[2]}, segment});
  }
  if (axes.size() != 6 || spacing.size() != 2 || !(spacing[0] > 0) || !(spacing[1] > 0))
    return "has no sound orientation and spacing; export it again";
  const Eigen::Vector3d row(axes[0], axes[1], axes[2]), column(axes[3], axes[4], axes[5]);
  if (std::abs(row.norm() - 1) > 0.01 || std::abs(column.norm() - 1) > 0.01 || std::abs(row.dot(column)) > 0.01)
    return "has no sound orientation and spacing; export it again";
  out.axes << row.normalized(), (column - column.dot(row) * row).normalized(), row.cross(column).normalized();
  out.spacing_mm = {spacing[1], spacing[0], !thickness.empty() && thickness[0] > 0 ? thickness[0] : 0};
  return {};
}

/// The least distance between frames that do not lie at the same place, mm; 0 where all do.
double least_step_mm(const std::vector<double>& along) {
  std::vector<double> sorted = along;
  std::sort(sorted.begin(), sorted.end());
  double least = 0;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    const double step = sorted[i] - sorted[i - 1];
    if (step > 0.01 && (least == 0 || step < least)) least = step;
  }
  return least;
}

/// A frame that gets the slice of another one of its segment, where slices lie a step apart; null where none does.
const LabelFrame* doubled_frame(const std::vector<LabelFrame>& frames, const std::vector<double>& along, double step) {
  const double low = *std::min_element(along.begin(), along.end());
  std::set<std::pair<int, double>> taken;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (!taken.emplace(frames[i].segment, std::round((along[i] - low) / step)).second) return &frames[i];
  }
  return nullptr;
}

/// The slice of each frame, from 0, in a stack from the first place to the last; empty, or what is wrong.
std::string stack_frames(const std::vector<LabelFrame>& frames, DicomLabels& out, std::vector<int>& slice_of) {
  constexpr double kLeastStep_mm = 0.1;  // of a CT; places that differ by less differ by rounding
  const Eigen::Vector3d normal = out.axes.col(2);
  std::vector<double> along;
  along.reserve(frames.size());
  for (const LabelFrame& frame : frames) along.push_back(frame.place_mm.dot(normal));
  const auto [low, high] = std::minmax_element(along.begin(), along.end());
  const double least = least_step_mm(along);
  // What files say of the step is the thickness at times, which may be more, or less.
  const double said = out.spacing_mm.z();
  const auto fits = [&along, low = *low](double step) {
    return step > 0 && std::all_of(along.begin(), along.end(), [&](double at) {
             const double slices = (at - low) / step;
             return std::abs(slices - std::round(slices)) < 0.2;
           });
  };
  double step = fits(said) ? said : fits(least) ? least : 0;
  // Two slices much thicker than they lie apart seem to be one.
  if (step > 0 && least >= kLeastStep_mm && fits(least) && doubled_frame(frames, along, step) != nullptr) step = least;
  if (step == 0 && *high - *low > 0.01) return "has frames at uneven distances; export it on the grid of the CT";
  out.spacing_mm.z() = step > 0 ? step : 1;
  const Eigen::Vector3d first = frames[static_cast<std::size_t>(low - along.begin())].place_mm;
  int last = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const double slices = (along[i] - *low) / out.spacing_mm.z();
    if (slices > 65000) return "reaches further than any CT; export it again";
    slice_of.push_back(static_cast<int>(std::lround(slices)));
    last = std::max(last, slice_of.back());
    const Eigen::Vector3d aside = frames[i].place_mm - first - (along[i] - *low) * normal;
    if (aside.norm() > 0.2 * out.spacing_mm.head<2>().minCoeff())
      return "has frames that lie beside one another; export it on the grid of the CT";
  }
  if (const LabelFrame* const frame = doubled_frame(frames, along, out.spacing_mm.z()); frame != nullptr) {
    return fmt::format(
        "has several frames{} at {:.6g}, {:.6g}, {:.6g} mm, of which only one can be meant; export it again",
        frame->segment == 0 ? "" : fmt::format(" of segment {}", frame->segment), frame->place_mm.x(),
        frame->place_mm.y(), frame->place_mm.z());
  }
  out.origin_mm = first;
  out.size[2] = last + 1;
  return {};
}

/// Into out.labels, out.size being known; empty, or what is wrong.
std::string lay_frames(const std::vector<LabelFrame>& frames, const std::vector<int>& slice_of,
                       const LabelPixels& pixels, DicomLabels& out) {
  int highest = 0;
  for (const NamedLabel& label : out.names) highest = std::max(highest, label.number);
  for (const LabelFrame& frame : frames) highest = std::max(highest, frame.segment);
  if (highest > kHighestLabel) return "numbers its segments too high; export it again";
  SharedValues values(highest);
  std::vector<char> is_segment(kHighestSegment + 1, 0);
  for (const NamedLabel& label : out.names) is_segment[static_cast<std::size_t>(label.number)] = 1;
  const std::size_t plane = pixels.per_frame();
  out.labels.assign(plane * static_cast<std::size_t>(out.size[2]), 0);
  for (std::size_t f = 0; f < frames.size(); ++f) {
    std::int16_t* const slice = out.labels.data() + static_cast<std::size_t>(slice_of[f]) * plane;
    for (std::size_t i = 0; i < plane; ++i) {
      const int pixel = pixels.at(f * plane + i);
      const bool by_pixel = frames[f].segment == 0;
      if (pixel < pixels.at_least) continue;
      if (by_pixel && is_segment[static_cast<std::size_t>(pixel)] == 0) {
        if (pixel == pixels.background) continue;
        return fmt::format("has a voxel of segment {}, which is none of its segments (0062,0002); export it again",
                           pixel);
      }
      const auto value = values.with(slice[i], by_pixel ? pixel : frames[f].segment);
      if (!value || *value > kHighestLabel) return "has too many segments that share voxels; export fewer of them";
      slice[i] = static_cast<std::int16_t>(*value);
    }
  }
  for (NamedLabel& label : out.names) {
    label.values = values.shared_by(label.number);
    label.values.insert(label.values.begin(), label.number);
  }
  return {};
}

}  // namespace

Result<DicomLabels> read_dicom_labels(const fs::path& path) {
  const auto loaded = load_dicom(path);
  if (!loaded) return loaded.error();
  DcmDataset& dataset = *(*loaded)->getDataset();
  const std::string type = text_of(dataset, DCM_SegmentationType);
  if (type != "BINARY" && type != "FRACTIONAL" && type != "LABELMAP") {
    return refused(Errc::unsupported, path,
                   fmt::format("is a segmentation of type '{}'; export it as a binary one", words_of(dataset, type)));
  }
  DicomLabels out;
  std::vector<LabelFrame> frames;
  std::vector<int> slice_of;
  LabelPixels pixels;
  out.series_uids = series_referred_to(dataset);
  const bool by_pixels = type == "LABELMAP";
  std::string wrong = read_names(dataset, by_pixels, out.names);
  if (wrong.empty()) wrong = read_frames(dataset, by_pixels, out, frames);
  if (wrong.empty()) wrong = stack_frames(frames, out, slice_of);
  if (wrong.empty()) wrong = read_pixels(dataset, static_cast<int>(frames.size()), pixels);
  if (!wrong.empty()) return refused(Errc::bad_format, path, wrong);
  out.size = {pixels.columns, pixels.rows, out.size[2]};
  if (pixels.per_frame() * static_cast<std::size_t>(out.size[2]) > kMostLabelVoxels)
    return refused(Errc::unsupported, path, "has more voxels than any CT; export it on the grid of the CT");
  if (type == "FRACTIONAL")
    pixels.at_least = std::max(1, (integer_of(dataset, DCM_MaximumFractionalValue).value_or(255) + 1) / 2);
  if (by_pixels) pixels.background = integer_of(dataset, DCM_PixelPaddingValue).value_or(0);
  // Voxels of labels that are 0 are of no structure.
  if (pixels.background != 0 && std::ranges::any_of(out.names, [](const auto& label) { return label.number == 0; })) {
    return refused(Errc::unsupported, path,
                   fmt::format("has a segment of the number 0 beside a background of {} (0028,0120); number its "
                               "segments from 1, and export it again",
                               pixels.background));
  }
  wrong = lay_frames(frames, slice_of, pixels, out);
  if (!wrong.empty()) return refused(Errc::bad_format, path, wrong);
  return out;
}

}  // namespace birdseye::host
