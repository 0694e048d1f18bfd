#include "hw-sim/local/local_line.hpp"

#include <algorithm>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "drivers/system/condition.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr std::size_t kHolds = std::size_t{64} << 10;

}  // namespace

struct LocalLine::State {
  struct Arrived {
    DeviceTime at;
    std::vector<std::uint8_t> bytes;
  };

  std::string name;
  std::mutex mutex;  // of what follows
  Condition changed;
  std::deque<Arrived> for_host;
  std::size_t held = 0;  ///< bytes in for_host
  std::vector<std::uint8_t> for_instrument;
  bool plugged = true, open = false;
};

namespace {

class InstrumentEnd final : public Endpoint {
 public:
  explicit InstrumentEnd(std::shared_ptr<LocalLine::State> line) : line_(std::move(line)) {}

  std::vector<std::uint8_t> read() override {
    const std::lock_guard lock(line_->mutex);
    return std::exchange(line_->for_instrument, {});
  }
  void write(std::span<const std::uint8_t> bytes) override {
    const std::lock_guard lock(line_->mutex);
    const std::size_t taken = line_->open ? std::min(bytes.size(), kHolds - line_->held) : 0;
    if (taken == 0) return;
    line_->for_host.push_back({device_now(), {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(taken)}});
    line_->held += taken;
    line_->changed.notify_all();
  }
  [[nodiscard]] bool connected() const override {
    const std::lock_guard lock(line_->mutex);
    return line_->open;
  }
  void wait(std::int64_t until_ns) override {
    std::unique_lock lock(line_->mutex);
    line_->changed.wait(lock, DeviceTime{until_ns}, [this] { return !line_->for_instrument.empty(); });
  }
  void unplug() override { set_plugged(false); }
  Result<void> replug() override {
    set_plugged(true);
    return {};
  }
  [[nodiscard]] const std::string& name() const override { return line_->name; }

 private:
  void set_plugged(bool plugged) {
    const std::lock_guard lock(line_->mutex);
    line_->plugged = plugged;
    line_->for_host.clear();
    line_->held = 0;
    line_->changed.notify_all();
  }

  std::shared_ptr<LocalLine::State> line_;
};

class DriverEnd final : public drivers::ByteStream {
 public:
  explicit DriverEnd(std::shared_ptr<LocalLine::State> line) : line_(std::move(line)) {}
  ~DriverEnd() override {
    const std::lock_guard lock(line_->mutex);
    line_->open = false;
    line_->for_host.clear();
    line_->held = 0;
  }
  DriverEnd(const DriverEnd&) = delete;
  DriverEnd& operator=(const DriverEnd&) = delete;

  Result<std::size_t> read(std::span<std::uint8_t> into, Deadline deadline) override {
    std::unique_lock lock(line_->mutex);
    line_->changed.wait(lock, deadline, [this] { return !line_->plugged || !line_->for_host.empty(); });
    if (!line_->plugged) return gone();
    std::size_t count = 0;
    while (count < into.size() && !line_->for_host.empty()) {
      auto& oldest = line_->for_host.front();
      if (count == 0) arrival_ = oldest.at;
      const std::size_t taken = std::min(into.size() - count, oldest.bytes.size());
      const auto end = oldest.bytes.begin() + static_cast<std::ptrdiff_t>(taken);
      std::copy(oldest.bytes.begin(), end, into.begin() + static_cast<std::ptrdiff_t>(count));
      oldest.bytes.erase(oldest.bytes.begin(), end);
      count += taken;
      line_->held -= taken;
      if (oldest.bytes.empty()) line_->for_host.pop_front();
    }
    return count;
  }
  Result<void> write(std::span<const std::uint8_t> bytes, Deadline /*deadline*/) override {
    const std::lock_guard lock(line_->mutex);
    if (!line_->plugged) return gone();
    line_->for_instrument.insert(line_->for_instrument.end(), bytes.begin(), bytes.end());
    line_->changed.notify_all();
    return {};
  }
  void discard_input() override {
    const std::lock_guard lock(line_->mutex);
    line_->for_host.clear();
    line_->held = 0;
  }
  bool set_rts(bool /*asserted*/) override { return false; }
  [[nodiscard]] const std::string& name() const override { return line_->name; }
  [[nodiscard]] std::optional<DeviceTime> arrival() const override { return arrival_; }

 private:
  [[nodiscard]] Error gone() const { return {Errc::disconnected, line_->name + ": the line is gone"}; }

  std::shared_ptr<LocalLine::State> line_;
  std::optional<DeviceTime> arrival_;
};

}  // namespace

LocalLine::LocalLine(const std::string& name) : state_(std::make_shared<State>()) {
  state_->name = name;
}

std::unique_ptr<Endpoint> LocalLine::instrument() const {
  return std::make_unique<InstrumentEnd>(state_);
}

Result<std::unique_ptr<drivers::ByteStream>> LocalLine::open() const {
  const std::lock_guard lock(state_->mutex);
  if (!state_->plugged) return Error{Errc::not_found, state_->name + ": is not there; plug it in"};
  if (state_->open) return Error{Errc::in_use, state_->name + ": is in use"};
  state_->open = true;
  state_->for_instrument.clear();
  return std::unique_ptr<drivers::ByteStream>(std::make_unique<DriverEnd>(state_));
}

}  // namespace birdseye::hw_sim
