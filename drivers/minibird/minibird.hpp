#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "calibration/time/clock_line.hpp"
#include "drivers/io/byte_stream.hpp"
#include "drivers/minibird/record_parser.hpp"

namespace birdseye::drivers::minibird {

struct MiniBirdSettings {
  int birds = 1;  ///< 1: standalone; more: a flock in group mode
  RecordFormat format = RecordFormat::position_matrix;
  Hemisphere hemisphere = Hemisphere::forward;
  double rate_hz = 103.3;
  int baud = 115200;  ///< to tell when a byte began from when it had come
  /// From the middle of a measurement to its first byte on the line, filters off.
  Duration delay = Duration::from_ms(7) + Duration{500'000};

  // The waits that field drivers use; tests shorten them.
  Duration reset_hold = Duration::from_ms(1000);
  Duration reset_settle = Duration::from_ms(2000);
  Duration configure_wait = Duration::from_ms(600);
  Duration run_wait = Duration::from_ms(200);
  Duration reply_timeout = Duration::from_ms(500);
  Duration answer_within = Duration::from_ms(5000);  ///< for the first answer after a reset
};

/// What the unit says of itself.
struct MiniBirdInfo {
  std::string model;
  int revision_major = 0, revision_minor = 0;
  int crystal_mhz = 0;
  double rate_hz = 0;
  double mm_per_count = kMmPerCount36Inch;
  bool has_reset_line = false;
  std::string latched_error;  ///< in words; empty for none
};

/// The poses of all birds at one measurement.
struct Measurement {
  DeviceTime acquired;
  Duration acquired_sigma;
  DeviceTime arrived;  ///< of its last byte
  /// One per bird, in the order of their addresses; empty where its record was lost or made no sense.
  std::vector<std::optional<RecordPose>> birds;
};

struct MiniBirdCounters {
  std::uint64_t measurements = 0, phase_errors = 0, discarded_bytes = 0, senseless_records = 0;
};

/// A miniBIRD, or a flock of them behind one port, streaming.
class MiniBird {
 public:
  /// Resets, examines and configures the unit, and starts its stream. Errors name the port and the remedy; one of them
  /// is that nothing answers. Takes seconds; stop ends it early.
  static Result<std::unique_ptr<MiniBird>> start(std::unique_ptr<ByteStream> line, const MiniBirdSettings& settings,
                                                 const std::stop_token& stop = {});
  ~MiniBird();
  MiniBird(const MiniBird&) = delete;
  MiniBird& operator=(const MiniBird&) = delete;

  [[nodiscard]] const MiniBirdInfo& info() const { return info_; }
  [[nodiscard]] MiniBirdCounters counters() const;
  /// The measurements that have come by the deadline, perhaps none; returns as soon as there is one.
  Result<std::vector<Measurement>> read(DeviceTime deadline);

 private:
  MiniBird(std::unique_ptr<ByteStream> line, const MiniBirdSettings& settings);
  Result<void> send(const Bytes& command);
  Result<Bytes> ask(const Bytes& command, std::size_t reply_bytes);
  Result<Bytes> ask_parameter(std::uint8_t parameter);
  Result<void> reset(const std::stop_token& stop);
  Result<void> examine_unit();
  Result<void> configure();
  Result<void> set_rate();
  void finish(std::vector<Measurement>& out);

  struct Partial {
    DeviceTime began;  ///< the first byte of the cycle was on the line
    DeviceTime arrived;
    std::vector<std::optional<RecordPose>> birds;
    std::size_t last_address = 0;
    std::uint64_t phase_errors = 0;  ///< of the parser when the cycle's first record was whole
  };

  std::unique_ptr<ByteStream> line_;
  MiniBirdSettings settings_;
  MiniBirdInfo info_;
  RecordParser parser_;
  ClockLine clock_line_;
  std::optional<Partial> partial_;
  MiniBirdCounters counters_;
};

}  // namespace birdseye::drivers::minibird
