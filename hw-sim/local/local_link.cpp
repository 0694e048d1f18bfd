#include "hw-sim/local/local_link.hpp"

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

struct LocalNetwork::State {
  struct OnItsWay {
    DeviceTime due;
    std::vector<std::uint8_t> bytes;
  };
  /// One direction of a connection.
  struct OneWay {
    std::deque<OnItsWay> parts;
    std::size_t held = 0;  ///< bytes in parts
    std::size_t read = 0;  ///< of the first part
    bool ended = false;
    bool silent = false;  ///< the server's machine has gone: the client knows of no end

    [[nodiscard]] bool readable(DeviceTime now) const { return parts.empty() ? ended : parts.front().due <= now; }
    /// When what is on its way is there; empty: nothing is.
    [[nodiscard]] std::optional<DeviceTime> next() const {
      return parts.empty() ? std::nullopt : std::optional(parts.front().due);
    }
  };

  Settings settings;
  std::mutex mutex;  // of what follows, and of all connections
  Duration late;     // of what the server sends
  Condition changed;
  std::deque<std::unique_ptr<wire::Link>> calling;
  std::vector<std::weak_ptr<OneWay>> ways;
  bool woken = false, listened = false;

  /// What is on its way is lost, on all connections that stand; each becomes as `how` says.
  void drop(void (*how)(OneWay&)) {
    const std::lock_guard lock(mutex);
    for (const auto& one : ways) {
      const auto way = one.lock();
      if (!way) continue;
      way->parts.clear();
      way->held = way->read = 0;
      how(*way);
    }
    changed.notify_all();
  }
};

namespace {

using OneWay = LocalNetwork::State::OneWay;

class LocalLink final : public wire::Link {
 public:
  enum class End { client, server };
  LocalLink(std::shared_ptr<LocalNetwork::State> network, End end, std::shared_ptr<OneWay> in,
            std::shared_ptr<OneWay> out)
      : network_(std::move(network)), end_(end), in_(std::move(in)), out_(std::move(out)) {}
  ~LocalLink() override {
    const std::lock_guard lock(network_->mutex);
    if (end_ == End::client || !in_->silent) in_->ended = out_->ended = true;
    network_->changed.notify_all();
  }
  LocalLink(const LocalLink&) = delete;
  LocalLink& operator=(const LocalLink&) = delete;

  Result<std::size_t> read_some(std::span<std::uint8_t> into) override {
    const std::lock_guard lock(network_->mutex);
    const DeviceTime now = device_now();
    if (in_->parts.empty() && in_->ended) return Error{Errc::disconnected, "the other side has gone"};
    std::size_t count = 0;
    while (count < into.size() && !in_->parts.empty() && in_->parts.front().due <= now) {
      const auto& bytes = in_->parts.front().bytes;
      const std::size_t taken = std::min(into.size() - count, bytes.size() - in_->read);
      std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(in_->read), taken,
                  into.begin() + static_cast<std::ptrdiff_t>(count));
      count += taken;
      in_->held -= taken;
      in_->read += taken;
      if (in_->read < bytes.size()) continue;
      in_->parts.pop_front();
      in_->read = 0;
    }
    if (count > 0) network_->changed.notify_all();
    return count;
  }
  Result<std::size_t> write_some(std::span<const std::span<const std::uint8_t>> parts) override {
    const std::lock_guard lock(network_->mutex);
    if (out_->ended) return Error{Errc::disconnected, "the other side has gone"};
    if (out_->silent) return lost(parts);
    const std::size_t room = network_->settings.holds - std::min(network_->settings.holds, out_->held);
    DeviceTime due = device_now() + network_->settings.delay;
    if (end_ == End::server) due = due + network_->late;
    if (!out_->parts.empty()) due = std::max(due, out_->parts.back().due);
    LocalNetwork::State::OnItsWay sent{due, {}};
    for (const auto& part : parts) {
      const std::size_t taken = std::min(part.size(), room - sent.bytes.size());
      sent.bytes.insert(sent.bytes.end(), part.begin(), part.begin() + static_cast<std::ptrdiff_t>(taken));
    }
    const std::size_t count = sent.bytes.size();
    if (count == 0) return count;
    out_->held += count;
    out_->parts.push_back(std::move(sent));
    network_->changed.notify_all();
    return count;
  }
  bool wait_readable(Deadline deadline) override {
    std::unique_lock lock(network_->mutex);
    for (;;) {
      if (in_->readable(device_now())) return true;
      if (deadline.passed()) return false;
      const auto due = in_->next();
      network_->changed.wait(lock, due ? std::min<Deadline>(deadline, *due) : deadline,
                             [this] { return in_->readable(device_now()); });
    }
  }
  bool wait_writable(Deadline deadline) override {
    std::unique_lock lock(network_->mutex);
    return network_->changed.wait(lock, deadline, [this] { return writable(); });
  }
  [[nodiscard]] std::string host() const override { return {}; }
  // With the network's mutex held.
  [[nodiscard]] const OneWay& in() const { return *in_; }
  [[nodiscard]] bool writable() const { return out_->held < network_->settings.holds || out_->ended; }

 private:
  static std::size_t lost(std::span<const std::span<const std::uint8_t>> parts) {
    std::size_t bytes = 0;
    for (const auto& part : parts) bytes += part.size();
    return bytes;
  }

  std::shared_ptr<LocalNetwork::State> network_;
  End end_;
  std::shared_ptr<OneWay> in_, out_;
};

class LocalListener final : public wire::Listener {
 public:
  explicit LocalListener(std::shared_ptr<LocalNetwork::State> network) : network_(std::move(network)) {
    const std::lock_guard lock(network_->mutex);
    network_->listened = true;
    for (const auto& one : network_->ways) {
      const auto way = one.lock();
      if (way && way->silent) way->ended = true;
    }
    network_->changed.notify_all();
  }
  ~LocalListener() override {
    std::deque<std::unique_ptr<wire::Link>> nobody_answers;  // ends without the mutex, which it takes
    const std::lock_guard lock(network_->mutex);
    network_->listened = false;
    nobody_answers.swap(network_->calling);
  }
  LocalListener(const LocalListener&) = delete;
  LocalListener& operator=(const LocalListener&) = delete;

  bool wait(std::span<wire::LinkWatch> links, bool to_accept, Deadline deadline) override {
    std::unique_lock lock(network_->mutex);
    const auto somebody = [&] { return to_accept && !network_->calling.empty(); };
    const auto ready = [&] {
      const DeviceTime now = device_now();
      bool any = network_->woken || somebody();
      for (wire::LinkWatch& watch : links) {
        const auto& link = *static_cast<const LocalLink*>(watch.link);
        watch.readable = watch.to_read && link.in().readable(now);
        any = any || watch.readable || (watch.to_write && link.writable());
      }
      return any;
    };
    while (!ready() && !deadline.passed()) {
      Deadline until = deadline;
      for (const wire::LinkWatch& watch : links) {
        if (const auto due = static_cast<const LocalLink*>(watch.link)->in().next(); due && watch.to_read)
          until = std::min<Deadline>(until, *due);
      }
      network_->changed.wait(lock, until, ready);
    }
    network_->woken = false;
    return somebody();
  }
  std::unique_ptr<wire::Link> accept() override {
    const std::lock_guard lock(network_->mutex);
    if (network_->calling.empty()) return nullptr;
    auto link = std::move(network_->calling.front());
    network_->calling.pop_front();
    return link;
  }
  void wake() override {
    const std::lock_guard lock(network_->mutex);
    network_->woken = true;
    network_->changed.notify_all();
  }
  [[nodiscard]] int port() const override { return 0; }

 private:
  std::shared_ptr<LocalNetwork::State> network_;
};

}  // namespace

LocalNetwork::LocalNetwork(const Settings& settings) : state_(std::make_shared<State>()) {
  state_->settings = settings;
}

std::unique_ptr<wire::Listener> LocalNetwork::listener() const {
  return std::make_unique<LocalListener>(state_);
}

std::unique_ptr<wire::Link> LocalNetwork::connect() const {
  const auto up = std::make_shared<OneWay>(), down = std::make_shared<OneWay>();
  auto here = std::make_unique<LocalLink>(state_, LocalLink::End::client, down, up);
  const std::lock_guard lock(state_->mutex);
  if (!state_->listened) {
    up->ended = down->ended = true;
    return here;
  }
  std::erase_if(state_->ways, [](const auto& way) { return way.expired(); });
  state_->ways.insert(state_->ways.end(), {up, down});
  state_->calling.push_back(std::make_unique<LocalLink>(state_, LocalLink::End::server, up, down));
  state_->changed.notify_all();
  return here;
}

void LocalNetwork::set_late(Duration late) const {
  const std::lock_guard lock(state_->mutex);
  state_->late = late;
}

void LocalNetwork::cut() const {
  state_->drop([](OneWay& way) { way.ended = true; });
}

void LocalNetwork::fall_silent() const {
  state_->drop([](OneWay& way) { way.silent = true; });
}

}  // namespace birdseye::hw_sim
