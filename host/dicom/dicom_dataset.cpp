#include "host/dicom/dicom_dataset.hpp"

#include <dcmtk/dcmdata/dcspchrs.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>

#include "host/dicom/refused.hpp"

namespace birdseye::host {

namespace fs = std::filesystem;

Result<std::unique_ptr<DcmFileFormat>> load_dicom(const fs::path& path) {
  // Some archives give up on what an attribute is, and write even the plainest with VR UN.
  dcmEnableUnknownVRConversion.set(OFTrue);
  auto file = std::make_unique<DcmFileFormat>();
  const OFCondition loaded = file->loadFile(path.c_str(), EXS_Unknown, EGL_noChange, DCM_MaxReadLength, ERM_autoDetect);
  if (loaded.bad()) return refused(Errc::bad_format, path, "is cut short, damaged or no DICOM; copy it again");
  return file;
}

std::string text_of(DcmItem& item, const DcmTagKey& tag, bool deep) {
  OFString value;
  if (item.findAndGetOFStringArray(tag, value, deep ? OFTrue : OFFalse).bad()) return {};
  std::string text(value.c_str());
  const std::size_t first = text.find_first_not_of(' ');
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

std::vector<double> numbers_in(const std::string& text) {
  std::vector<double> numbers;
  std::istringstream words(text);
  for (std::string word; std::getline(words, word, '\\');) {
    char* end = nullptr;
    const double number = std::strtod(word.c_str(), &end);
    if (end == word.c_str() ||
        word.find_first_not_of(' ', static_cast<std::size_t>(end - word.c_str())) != std::string::npos ||
        !std::isfinite(number)) {
      return {};
    }
    numbers.push_back(number);
  }
  return numbers;
}

std::optional<int> integer_of(DcmItem& item, const DcmTagKey& tag) {
  const auto numbers = numbers_in(text_of(item, tag));
  if (numbers.empty() || std::abs(numbers[0]) > std::numeric_limits<int>::max() || numbers[0] != std::floor(numbers[0]))
    return std::nullopt;
  return static_cast<int>(numbers[0]);
}

DcmItem* item_of(DcmItem& item, const DcmTagKey& sequence) {
  DcmItem* found = nullptr;
  return item.findAndGetSequenceItem(sequence, found).good() ? found : nullptr;
}

std::vector<DcmItem*> items_of(DcmItem& item, const DcmTagKey& sequence) {
  std::vector<DcmItem*> items;
  DcmSequenceOfItems* found = nullptr;
  if (item.findAndGetSequence(sequence, found).bad() || found == nullptr) return items;
  for (DcmObject* next = found->nextInContainer(nullptr); next != nullptr; next = found->nextInContainer(next))
    items.push_back(static_cast<DcmItem*>(next));
  return items;
}

std::string words_of(DcmDataset& dataset, const std::string& text) {
  std::string words = text;
  const auto is_ascii = [](char c) { return static_cast<unsigned char>(c) < 0x80; };
  if (!std::all_of(words.begin(), words.end(), is_ascii)) {
    DcmSpecificCharacterSet from;
    OFString turned;
    const std::string set = text_of(dataset, DCM_SpecificCharacterSet);
    // Without a set only ASCII is allowed; those who write more mean Latin-1.
    if (from.selectCharacterSet(set.empty() ? "ISO_IR 100" : set.c_str()).good() &&
        from.convertString(words.c_str(), words.size(), turned, "\\^=").good()) {
      words = turned.c_str();
    } else {
      std::replace_if(
          words.begin(), words.end(), [&](char c) { return !is_ascii(c); }, '?');
    }
  }
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; };
  std::replace_if(words.begin(), words.end(), is_control, ' ');
  return words;
}

std::string FrameElements::text(const DcmTagKey& tag) const {
  for (DcmItem* group : {own_, shared_}) {
    if (group == nullptr) continue;
    if (std::string text = text_of(*group, tag, true); !text.empty()) return text;
  }
  return text_of(*dataset_, tag);
}

bool FrameElements::has(const DcmTagKey& tag) const {
  return (own_ != nullptr && own_->tagExists(tag, OFTrue)) || (shared_ != nullptr && shared_->tagExists(tag, OFTrue)) ||
         dataset_->tagExists(tag);
}

}  // namespace birdseye::host
