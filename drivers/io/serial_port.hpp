#pragma once

#include <filesystem>
#include <memory>

#include "drivers/io/byte_stream.hpp"
#include "drivers/io/unique_fd.hpp"

namespace birdseye::drivers {

inline constexpr const char* kSerialSpeeds = "2400, 4800, 9600, 19200, 38400, 57600, 115200";
bool is_serial_speed(int baud);

/// A serial port of the operating system: 8N1, raw, no flow control of either kind.
class SerialPort final : public ByteStream {
 public:
  /// baud: one of kSerialSpeeds. RTS is released at once: opening asserts it, and some instruments take it
  /// for a reset. Refuses what is not there, is no terminal, or is held by another program.
  static Result<std::unique_ptr<SerialPort>> open(const std::filesystem::path& device, int baud);

  Result<std::size_t> read(std::span<std::uint8_t> into, DeviceTime deadline) override;
  Result<void> write(std::span<const std::uint8_t> bytes, DeviceTime deadline) override;
  void discard_input() override;
  bool set_rts(bool asserted) override;
  [[nodiscard]] const std::string& name() const override { return name_; }

 private:
  SerialPort(UniqueFd fd, std::string name) : fd_(std::move(fd)), name_(std::move(name)) {}

  UniqueFd fd_;
  std::string name_;
};

}  // namespace birdseye::drivers
