#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <vector>

#include "drivers/io/usb_port.hpp"
#include "drivers/system/condition.hpp"

namespace birdseye::testing {

/// An FT232R as seen through UsbPort: remembers what it is told, sends what it is given. The test holds it by a shared
/// pointer and hands the driver a port onto it, as a chip outlives the program that claims it.
class FakeFt232r {
 public:
  using Bytes = std::vector<std::uint8_t>;

  drivers::UsbIdentity identity{"usb:0403:6001:TRK001", 0x0403, 0x6001, 0x0600, "FT232R USB UART", "TRK001", true, 64};
  int least_latency_ms = 1;     ///< takes no shorter latency timer
  bool stalls_latency = false;  ///< does not know the latency requests
  std::size_t takes = 64;       ///< bytes of a bulk OUT at a time; 0: it does not react

  /// One IN transfer as it comes off the bus, at that time.
  void deliver(Bytes transfer, DeviceTime arrived = {}) {
    const std::lock_guard lock(mutex_);
    input_.push_back({std::move(transfer), arrived, false});
    changed_.notify_all();
  }
  void fail_transfer() {
    const std::lock_guard lock(mutex_);
    input_.push_back({{}, {}, true});
    changed_.notify_all();
  }
  void unplug() {
    const std::lock_guard lock(mutex_);
    unplugged_ = true;
    changed_.notify_all();
  }
  /// All that was asked of it, in order, since the last call.
  std::vector<drivers::SetupPacket> requests() {
    const std::lock_guard lock(mutex_);
    return std::exchange(requests_, {});
  }
  Bytes written() {
    const std::lock_guard lock(mutex_);
    return std::exchange(written_, {});
  }
  /// Until everything delivered has been collected.
  [[nodiscard]] bool drained() {
    std::unique_lock lock(mutex_);
    return changed_.wait(lock, Deadline::after(Duration::from_ms(20'000)), [this] { return input_.empty(); });
  }
  /// Until whoever collects has been told that it is unplugged.
  [[nodiscard]] bool seen_gone() {
    std::unique_lock lock(mutex_);
    return changed_.wait(lock, Deadline::after(Duration::from_ms(20'000)), [this] { return told_gone_; });
  }
  int transfers_going = 0;
  bool claimed = false;

  class Port;
  static std::unique_ptr<drivers::UsbPort> plug(std::shared_ptr<FakeFt232r> chip);

 private:
  friend class Port;
  static Error gone() { return {Errc::disconnected, "fake: unplugged"}; }

  std::mutex mutex_;
  Condition changed_;
  std::deque<drivers::UsbInput> input_;
  std::vector<drivers::SetupPacket> requests_;
  Bytes written_;
  std::uint8_t latency_ms_ = 16;
  bool unplugged_ = false, told_gone_ = false, woken_ = false;
};

class FakeFt232r::Port final : public drivers::UsbPort {
 public:
  explicit Port(std::shared_ptr<FakeFt232r> chip) : chip_(std::move(chip)) { chip_->claimed = true; }
  ~Port() override { chip_->claimed = false; }

  [[nodiscard]] const drivers::UsbIdentity& identity() const override { return chip_->identity; }

  Result<std::vector<std::uint8_t>> control(const drivers::SetupPacket& setup, Deadline /*deadline*/) override {
    const std::lock_guard lock(chip_->mutex_);
    if (chip_->unplugged_) return gone();
    chip_->requests_.push_back(setup);
    const bool of_latency = setup[1] == 0x09 || setup[1] == 0x0A;
    if (of_latency && chip_->stalls_latency) return Error{Errc::unsupported, "fake: stalls"};
    if (setup[1] == 0x09) chip_->latency_ms_ = std::max(setup[2], static_cast<std::uint8_t>(chip_->least_latency_ms));
    if (setup[1] == 0x0A) return Bytes{chip_->latency_ms_};
    return Bytes(setup[6], 0);
  }
  Result<std::size_t> bulk_out(std::span<const std::uint8_t> bytes, Deadline /*deadline*/) override {
    const std::lock_guard lock(chip_->mutex_);
    if (chip_->unplugged_) return gone();
    const std::size_t count = std::min(chip_->takes, bytes.size());
    chip_->written_.insert(chip_->written_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count));
    return count;
  }
  Result<void> start_reading(int transfers) override {
    chip_->transfers_going = transfers;
    return {};
  }
  Result<std::optional<drivers::UsbInput>> collect(Deadline deadline) override {
    std::unique_lock lock(chip_->mutex_);
    chip_->changed_.wait(lock, deadline,
                         [this] { return !chip_->input_.empty() || chip_->unplugged_ || chip_->woken_; });
    chip_->woken_ = false;
    if (!chip_->input_.empty()) {
      std::optional<drivers::UsbInput> input = std::move(chip_->input_.front());
      chip_->input_.pop_front();
      chip_->changed_.notify_all();
      return input;
    }
    if (chip_->unplugged_) {
      chip_->told_gone_ = true;
      chip_->changed_.notify_all();
      return gone();
    }
    return std::optional<drivers::UsbInput>();
  }
  void wake() override {
    const std::lock_guard lock(chip_->mutex_);
    chip_->woken_ = true;
    chip_->changed_.notify_all();
  }

 private:
  std::shared_ptr<FakeFt232r> chip_;
};

inline std::unique_ptr<drivers::UsbPort> FakeFt232r::plug(std::shared_ptr<FakeFt232r> chip) {
  return std::make_unique<Port>(std::move(chip));
}

}  // namespace birdseye::testing
