#include "drivers/minibird/record_parser.hpp"

#include <utility>

namespace birdseye::drivers::minibird {

namespace {

std::vector<RecordFormat> formats_of(const StreamLayout& layout) {
  std::vector<RecordFormat> formats;
  for (const BirdLayout& bird : layout.birds) formats.push_back(bird.format);
  return formats;
}

}  // namespace

RecordParser::RecordParser(const StreamLayout& layout)
    : RecordParser(formats_of(layout), layout.button_byte, layout.group_mode) {}

RecordParser::RecordParser(std::vector<RecordFormat> formats, bool button_mode, bool group_mode)
    : formats_(std::move(formats)), button_mode_(button_mode), group_mode_(group_mode) {}

std::size_t RecordParser::record_bytes() const {
  return 2 * word_count(formats_[turn_]) + (button_mode_ ? 1 : 0) + (group_mode_ ? 1 : 0);
}

void RecordParser::reset() {
  discarded_bytes_ += partial_.size();
  partial_.clear();
  expect_start_ = false;
}

Record RecordParser::take() {
  Record record;
  const std::size_t words = word_count(formats_[turn_]);
  for (std::size_t i = 0; i < words; ++i) record.words.push_back(decode_word(partial_[2 * i], partial_[2 * i + 1]));
  std::size_t at = 2 * words;
  if (button_mode_) record.button = partial_[at++];
  if (group_mode_) record.address = partial_[at];
  return record;
}

std::vector<Record> RecordParser::push(std::span<const std::uint8_t> bytes) {
  std::vector<Record> records;
  for (const std::uint8_t byte : bytes) {
    const std::int64_t at = position_++;
    if ((byte & 0x80U) != 0) {
      if (!partial_.empty()) {
        // A record began before the last one was whole: bytes of that one were lost.
        ++phase_errors_;
        discarded_bytes_ += partial_.size();
        partial_.clear();
      }
      partial_.push_back(byte);
      begin_ = at;
      expect_start_ = false;
    } else if (partial_.empty()) {
      if (expect_start_) ++phase_errors_;
      expect_start_ = false;
      ++discarded_bytes_;
      continue;
    } else {
      partial_.push_back(byte);
    }
    if (partial_.size() < record_bytes()) continue;
    Record record = take();
    record.begin = begin_;
    record.phase_errors = phase_errors_;
    record.discarded_bytes = discarded_bytes_;
    partial_.clear();
    expect_start_ = true;
    if (group_mode_) {
      if (record.address == 0 || record.address > formats_.size()) {
        ++phase_errors_;  // the length was right for another unit's format: start over with the first
        turn_ = 0;
        continue;
      }
      turn_ = record.address % formats_.size();
    }
    records.push_back(std::move(record));
  }
  return records;
}

}  // namespace birdseye::drivers::minibird
