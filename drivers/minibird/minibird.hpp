#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "drivers/io/byte_stream.hpp"
#include "drivers/minibird/dialogue.hpp"
#include "drivers/minibird/settings.hpp"
#include "drivers/minibird/stream_layout.hpp"
#include "drivers/minibird/unit_info.hpp"

namespace birdseye::drivers::minibird {

/// What the unit says of itself; in a flock, the master.
struct MiniBirdInfo {
  std::string model;
  int revision_major = 0, revision_minor = 0;
  int crystal_mhz = 0;
  double rate_hz = 0;  ///< of measurements
  double mm_per_count = kMmPerCount36Inch;
  bool has_reset_line = false;
  bool warm = false;          ///< the unit had all settings already, and was not reset
  std::string not_warm;       ///< why not, in words
  std::string latched_error;  ///< an error that some unit had latched before the start, in words; empty for none
  std::vector<UnitInfo> units;
  std::vector<std::string> notes;  ///< settings that the firmware cannot do, and the like
};

/// What a unit in trouble says.
struct Diagnosis {
  std::string words;              ///< of all units, one line
  std::vector<UnitError> errors;  ///< that were latched; they are cleared by now
  bool needs_start = false;       ///< a unit has lost its settings or has halted; the stream was not begun again
};

/// The conversation with a miniBIRD, or with a flock of them behind one port: set up, then streaming.
/// MeasurementAssembler knows what the bytes of the stream mean.
class MiniBird {
 public:
  /// Resets, examines and configures the unit, and starts its stream. A unit that has all settings already is not
  /// reset. Errors name the port and the remedy: nothing answers (timeout), what answers is something else
  /// (bad_format), the unit does not take a setting (bad_value). Takes up to seconds, and half a minute
  /// for a large flock; stop ends it early, and `still` is called all the while.
  static Result<std::unique_ptr<MiniBird>> start(std::unique_ptr<ByteStream> line, const MiniBirdSettings& settings,
                                                 const std::stop_token& stop = {},
                                                 const std::function<void()>& still = {});
  /// Tells the unit to be quiet.
  ~MiniBird();
  MiniBird(const MiniBird&) = delete;
  MiniBird& operator=(const MiniBird&) = delete;

  [[nodiscard]] const MiniBirdInfo& info() const { return info_; }
  /// How the bytes that read() gives are to be understood.
  [[nodiscard]] const StreamLayout& layout() const { return layout_; }
  /// The bytes that have come, as soon as there are some; none at the deadline. Errc::disconnected when the line is
  /// gone.
  Result<std::optional<Chunk>> read(Deadline deadline);

  /// For a stream in trouble (saturated, silent, phase errors): stops it, has the units tell their status and errors,
  /// and begins it again. About half a second. Errc::timeout: nothing answers.
  Result<Diagnosis> diagnose(const std::stop_token& stop = {});

 private:
  MiniBird(std::unique_ptr<ByteStream> line, const MiniBirdSettings& settings);
  Result<void> begin();
  Result<std::string> try_warm();
  Result<std::string> odd_status(std::size_t index);
  Result<void> reset();
  Result<void> gather_flock();
  Result<void> check_flock();
  Result<void> examine_units();
  Result<void> configure();
  Result<void> note_errors();
  Result<void> run();
  Result<void> check_record();
  Result<void> stream();
  /// Measures and streams again.
  Result<void> wake();
  Result<Diagnosis> look_for_trouble();
  [[nodiscard]] std::uint8_t address_of(std::size_t index) const;

  std::unique_ptr<ByteStream> line_;
  MiniBirdSettings settings_;
  Dialogue dialogue_;
  MiniBirdInfo info_;
  StreamLayout layout_;
  std::uint64_t line_errors_ = 0;  ///< of the line, when it was last read
  bool restarted_ = false;         ///< since the last chunk
};

}  // namespace birdseye::drivers::minibird
