#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "drivers/io/byte_stream.hpp"
#include "drivers/minibird/settings.hpp"
#include "drivers/minibird/stream_layout.hpp"

namespace birdseye::drivers::minibird {

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
  /// How the bytes that read() gives are to be understood.
  [[nodiscard]] const StreamLayout& layout() const { return layout_; }
  /// The bytes that have come, as soon as there are some; none at the deadline. Errc::disconnected when the line is
  /// gone.
  Result<std::optional<Chunk>> read(DeviceTime deadline);

 private:
  MiniBird(std::unique_ptr<ByteStream> line, const MiniBirdSettings& settings);
  Result<void> send(const Bytes& command);
  Result<Bytes> ask(const Bytes& command, std::size_t reply_bytes);
  Result<Bytes> ask_parameter(std::uint8_t parameter);
  Result<void> reset(const std::stop_token& stop);
  Result<void> examine_unit();
  Result<void> configure();
  Result<void> set_rate();

  std::unique_ptr<ByteStream> line_;
  MiniBirdSettings settings_;
  MiniBirdInfo info_;
  StreamLayout layout_;
  std::uint64_t line_errors_ = 0;  ///< of the line, when it was last read
};

}  // namespace birdseye::drivers::minibird
