#pragma once

#include <memory>
#include <mutex>
#include <optional>

#include "drivers/io/byte_stream.hpp"
#include "drivers/io/ftdi_protocol.hpp"
#include "drivers/io/ftdi_receiver.hpp"
#include "drivers/io/usb_port.hpp"
#include "drivers/system/condition.hpp"
#include "drivers/system/thread.hpp"

namespace birdseye::drivers {

struct FtdiSettings {
  int baud = 115200;
  int latency_ms = 1;           ///< how long the chip collects bytes before it passes them on, 1 to 255
  int transfers = 6;            ///< IN transfers kept going, of one packet each
  std::size_t buffer = 65'536;  ///< bytes that wait for a reader; six seconds at 115200 baud
};

/// An FTDI serial adapter driven straight over USB: 8N1, no flow control, RTS and DTR ours alone. The kernel's serial
/// port asserts RTS whenever it is opened, which some instruments take for a reset; FtdiPort does not.
class FtdiPort final : public ByteStream {
 public:
  /// Resets the adapter, sets it up and begins to read. Refuses a chip that chip_of() does not know.
  static Result<std::unique_ptr<FtdiPort>> open(std::unique_ptr<UsbPort> usb, const FtdiSettings& settings);
  ~FtdiPort() override;
  FtdiPort(const FtdiPort&) = delete;
  FtdiPort& operator=(const FtdiPort&) = delete;

  Result<std::size_t> read(std::span<std::uint8_t> into, Deadline deadline) override;
  Result<void> write(std::span<const std::uint8_t> bytes, Deadline deadline) override;
  void discard_input() override;
  bool set_rts(bool asserted) override;
  [[nodiscard]] const std::string& name() const override { return usb_->identity().name; }
  [[nodiscard]] std::uint64_t line_errors() const override;
  [[nodiscard]] std::optional<DeviceTime> arrival() const override { return arrival_; }
  [[nodiscard]] std::string describe() const override;

  [[nodiscard]] FtdiCounters counters() const;

 private:
  FtdiPort(std::unique_ptr<UsbPort> usb, const FtdiSettings& settings, ftdi::Chip chip);
  Result<void> set_up();
  Result<void> set_up_latency();
  Result<void> send(const SetupPacket& request);
  Result<void> purge_both();
  void pump(const std::stop_token& stop);

  std::unique_ptr<UsbPort> usb_;
  FtdiSettings settings_;
  ftdi::Chip chip_;
  double actual_baud_ = 0;
  std::optional<int> actual_latency_ms_;  ///< as the chip says; empty when it has no timer
  std::optional<DeviceTime> arrival_;

  mutable std::mutex mutex_;  // of all below
  Condition came_;
  FtdiReceiver receiver_;
  std::optional<Error> ended_;

  OwnedThread pump_;
};

}  // namespace birdseye::drivers
