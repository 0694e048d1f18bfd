#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>

#include "drivers/io/byte_stream.hpp"
#include "drivers/io/serial_marks.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye::drivers {

inline constexpr const char* kSerialSpeeds = "2400, 4800, 9600, 19200, 38400, 57600, 115200";
bool is_serial_speed(int baud);

/// A serial port of the operating system: 8N1, raw, no flow control of either kind.
class SerialPort final : public ByteStream {
 public:
  /// baud: one of kSerialSpeeds. Releases RTS at once, which opening asserts and some instruments take for a reset.
  /// Refuses a device that is not there, is no terminal, or is held by another program. usb_latency_ms: for the timer
  /// of an FTDI adapter, where the kernel lets it be set.
  static Result<std::unique_ptr<SerialPort>> open(const std::filesystem::path& device, int baud,
                                                  int usb_latency_ms = 1);

  Result<std::size_t> read(std::span<std::uint8_t> into, Deadline deadline) override;
  Result<void> write(std::span<const std::uint8_t> bytes, Deadline deadline) override;
  void discard_input() override;
  bool set_rts(bool asserted) override;
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::uint64_t line_errors() const override { return line_errors_; }
  [[nodiscard]] std::string describe() const override { return description_; }

 private:
  SerialPort(UniqueFd fd, std::string name) : fd_(std::move(fd)), name_(std::move(name)) {}
  std::size_t decode(std::span<std::uint8_t> into);
  [[nodiscard]] std::optional<std::uint64_t> overruns() const;
  bool lost_bytes();
  [[nodiscard]] Error gone() const;

  UniqueFd fd_;
  std::string name_, description_;
  std::array<std::uint8_t, 512> raw_{};
  std::size_t raw_begin_ = 0, raw_end_ = 0;  ///< what of it waits to be decoded
  bool marked_ = false;                      ///< whether the terminal marks damage
  SerialMarks marks_;
  bool damage_next_ = false;  ///< damage lies between the last bytes read and the next
  std::uint64_t line_errors_ = 0;
  std::optional<std::uint64_t> overruns_;  ///< as the driver counts them, if it does
};

}  // namespace birdseye::drivers
