#include "host/dicom/dicom_dataset.hpp"

#include <dcmtk/dcmdata/dcspchrs.h>
#include <dcmtk/oflog/oflog.h>
#include <dcmtk/oflog/spi/logevent.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>

#include "host/dicom/refused.hpp"

namespace birdseye::host {

namespace fs = std::filesystem;

namespace {

/// The tag, as "(0020,0032)", of an element that this thread read twice; empty where there was none.
std::string& tag_read_twice() {
  thread_local std::string tag;
  return tag;
}

/// Of two elements of one tag DCMTK drops the second as it reads, and tells it to nobody but its log.
class ReadTwice : public dcmtk::log4cplus::Appender {
 public:
  ReadTwice() = default;
  ReadTwice(const ReadTwice&) = delete;
  ReadTwice& operator=(const ReadTwice&) = delete;
  ~ReadTwice() override { destructorImpl(); }
  void close() override {}

 protected:
  void append(const dcmtk::log4cplus::spi::InternalLoggingEvent& event) override {
    const std::string said(event.getMessage().c_str());
    const std::size_t end = said.find(") found twice"), begin = said.rfind('(', end);
    if (end == std::string::npos || begin == std::string::npos || !tag_read_twice().empty()) return;
    const auto group = std::strtoul(said.c_str() + begin + 1, nullptr, 16);
    // Those of odd groups are a maker's own and not read here; zeros behind a file's end pass for group 0.
    if (group != 0 && group % 2 == 0) tag_read_twice() = said.substr(begin, end + 1 - begin);
  }
};

void hear_of_elements_read_twice() {
  static const bool hears = [] {
    OFLog::getLogger("dcmtk.dcmdata").addAppender(dcmtk::log4cplus::SharedAppenderPtr(new ReadTwice));
    return true;
  }();
  static_cast<void>(hears);
}

}  // namespace

Result<std::unique_ptr<DcmFileFormat>> load_dicom(const fs::path& path, std::string* twice) {
  // Some archives give up on what an attribute is, and write even the plainest with VR UN.
  dcmEnableUnknownVRConversion.set(OFTrue);
  hear_of_elements_read_twice();
  tag_read_twice().clear();
  auto file = std::make_unique<DcmFileFormat>();
  const OFCondition loaded = file->loadFile(path.c_str(), EXS_Unknown, EGL_noChange, DCM_MaxReadLength, ERM_autoDetect);
  if (loaded.bad()) return refused(Errc::bad_format, path, "is cut short, damaged or no DICOM; copy it again");
  std::string found = tag_read_twice().empty() ? "" : fmt::format("has {} twice; export it again", tag_read_twice());
  if (twice == nullptr && !found.empty()) return refused(Errc::bad_format, path, found);
  if (twice != nullptr) *twice = std::move(found);
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
