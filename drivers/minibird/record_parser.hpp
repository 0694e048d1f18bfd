#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/minibird/protocol.hpp"
#include "drivers/minibird/stream_layout.hpp"

namespace birdseye::drivers::minibird {

/// One whole miniBIRD record as it came off the line: the bytes of one measurement of one bird.
struct Record {
  std::vector<std::int16_t> words;
  std::uint8_t button = 0;   ///< 0 where the records carry none
  std::uint8_t address = 0;  ///< the unit that sent it; 0 where the records carry none
  std::int64_t begin = 0;    ///< the index of its first byte among all bytes ever pushed
  /// The parser's counts when the record was whole: a step from one record to the next means that bytes were lost or
  /// added between them.
  std::uint64_t phase_errors = 0, discarded_bytes = 0;
};

/// The receiver: finds records in a stream of bytes by the phase bit, which only the first byte of a record has set.
/// The parser cannot see a corrupted byte whose phase bit is clear, for the wire carries no checksum: decode_pose()
/// checks whether the pose makes sense.
class RecordParser {
 public:
  /// The formats of the units, in the order of their addresses; one unit without group mode: one format. A record's
  /// length follows from the format of the unit whose turn it is.
  RecordParser(std::vector<RecordFormat> formats, bool button_mode, bool group_mode);

  explicit RecordParser(const StreamLayout& layout);

  std::vector<Record> push(std::span<const std::uint8_t> bytes);
  /// Drops a partial record, as after a line error whose place is not known, and looks for the next phase bit.
  void reset();

  [[nodiscard]] std::uint64_t phase_errors() const { return phase_errors_; }
  [[nodiscard]] std::uint64_t discarded_bytes() const { return discarded_bytes_; }

 private:
  [[nodiscard]] std::size_t record_bytes() const;
  [[nodiscard]] Record take();

  std::vector<RecordFormat> formats_;
  bool button_mode_, group_mode_;
  std::size_t turn_ = 0;
  std::vector<std::uint8_t> partial_;
  std::int64_t begin_ = 0, position_ = 0;  ///< of the partial record, and of the next byte, in all that was pushed
  bool expect_start_ = false;              ///< a record has just ended: the next byte must begin one
  std::uint64_t phase_errors_ = 0, discarded_bytes_ = 0;
};

}  // namespace birdseye::drivers::minibird
