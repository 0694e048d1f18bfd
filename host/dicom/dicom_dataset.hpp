#pragma once

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// What is believed of a file's claims, along a row or column: a CT has 512 pixels, some 2048.
inline constexpr int kMostPixels = 8192;

/// A DICOM file's elements. Long values stay in the file until they are asked for. Errc::bad_format where it is none,
/// is cut short, or has an element twice, of which one reader takes the first and another the last. twice: where it is
/// not null, it gets what is wrong with such a file, which is not refused then.
Result<std::unique_ptr<DcmFileFormat>> load_dicom(const std::filesystem::path& path, std::string* twice = nullptr);

/// The text of a tag with all of its values, without padding; empty where there is none. deep: also within sequences.
std::string text_of(DcmItem& item, const DcmTagKey& tag, bool deep = false);
/// The numbers of such a text, as "1\\0.5"; empty where one of them is none, or is not finite.
std::vector<double> numbers_in(const std::string& text);
/// A whole number that an int holds.
std::optional<int> integer_of(DcmItem& item, const DcmTagKey& tag);
/// The first item of a sequence; null where there is none.
DcmItem* item_of(DcmItem& item, const DcmTagKey& sequence);
/// All items of a sequence, in its order.
std::vector<DcmItem*> items_of(DcmItem& item, const DcmTagKey& sequence);
/// A text for people, turned from the file's character set to UTF-8; what cannot be turned, and what no line holds, is
/// replaced.
std::string words_of(DcmDataset& dataset, const std::string& text);

/// The elements that hold for one frame: those of its own functional groups before those that the frames share, before
/// the file's.
class FrameElements {
 public:
  /// own, shared: null where there are none, as in a file of one frame.
  FrameElements(DcmDataset& dataset, DcmItem* own, DcmItem* shared) : dataset_(&dataset), own_(own), shared_(shared) {}

  [[nodiscard]] std::string text(const DcmTagKey& tag) const;
  [[nodiscard]] std::vector<double> numbers(const DcmTagKey& tag) const { return numbers_in(text(tag)); }
  [[nodiscard]] bool has(const DcmTagKey& tag) const;

 private:
  DcmDataset* dataset_;
  DcmItem* own_;
  DcmItem* shared_;
};

}  // namespace birdseye::host
