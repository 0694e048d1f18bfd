#include "drivers/gpio/gpio_lines.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <gpiod.h>
#include <sys/utsname.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <span>
#include <utility>

#include "drivers/gpio/debouncer.hpp"
#include "drivers/gpio/gpio_chip.hpp"
#include "drivers/gpio/kernel_stamps.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::drivers {

namespace {

constexpr const char* kConsumer = "birdseyed";
constexpr std::size_t kKernelQueue = 16;  // edges that the kernel keeps of a line; more are lost there
/// A line that fills that queue at once is none of a strobe or a pedal (a loose wire picks up anything): it is read no
/// oftener than this, and what the kernel drops meanwhile is no loss.
constexpr Duration kFloodPause = Duration::from_ms(2);
static_assert(2 * (kKernelQueue + 1) <= GpioLines::kMostEdges);

struct InputLine {
  GpioInput input = GpioInput::strobe;
  gpiod_line* line = nullptr;
  int fd = -1;
  bool last = false;  // as the edge before left it
};

bool is_number(const std::string& text) {
  return !text.empty() && text.size() < 5 &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

class KernelGpioLines final : public GpioLines {
 public:
  KernelGpioLines(GpioChip chip, const GpioSettings& settings)
      : chip_(std::move(chip)), name_(settings.chip), pedal_hold_(settings.pedal_debounce) {}

  Result<void> request(const GpioSettings& s) {
    if (auto got = request_input(GpioInput::strobe, s.strobe, s.strobe_active_low, s.strobe_bias); !got) return got;
    if (auto got = request_input(GpioInput::pedal, s.pedal, s.pedal_active_low, s.pedal_bias); !got) return got;
    if (auto got = request_output(led_, "led", s.led, s.led_active_low); !got) return got;
    return request_output(trigger_, "trigger", s.trigger, s.trigger_active_low);
  }

  Result<std::vector<GpioEdge>> read(Deadline deadline) override;
  Result<void> set_led(bool on) override { return set(led_, on); }
  Result<void> set_trigger(bool on) override { return set(trigger_, on); }
  [[nodiscard]] GpioCounters counters() const override { return {counters_.edges, pedal_.bounces(), counters_.lost}; }
  [[nodiscard]] std::string describe() const override {
    return fmt::format("{}: {} ({}){}", name_, gpiod_chip_name(chip_.get()), gpiod_chip_label(chip_.get()), used_);
  }

 private:
  Result<gpiod_line*> find(const char* purpose, const std::string& wanted);
  Result<void> request_line(gpiod_line* line, const char* purpose, const std::string& wanted, int type, int flags);
  Result<void> request_input(GpioInput input, const std::string& wanted, bool active_low, GpioBias bias);
  Result<void> request_output(gpiod_line*& line, const char* purpose, const std::string& wanted, bool active_low);
  Result<void> wait(Deadline until, std::array<pollfd, 2>& entries);
  Result<void> drain(InputLine& line, std::vector<GpioEdge>& edges);
  void take(InputLine& line, bool active, DeviceTime at, std::vector<GpioEdge>& edges);
  Result<void> settle_pedal(std::vector<GpioEdge>& edges);
  [[nodiscard]] Result<void> still_there() const;
  Result<void> set(gpiod_line* line, bool on);
  [[nodiscard]] Error gone() const {
    return {Errc::disconnected, fmt::format("{}: the GPIO chip has gone; was it unplugged?", name_)};
  }

  GpioChip chip_;
  std::string name_, used_;
  std::vector<InputLine> inputs_;  // at most two
  gpiod_line* led_ = nullptr;
  gpiod_line* trigger_ = nullptr;
  Duration pedal_hold_;
  Debouncer pedal_{pedal_hold_, false};
  GpioCounters counters_;
  bool flooded_ = false;
};

Result<gpiod_line*> KernelGpioLines::find(const char* purpose, const std::string& wanted) {
  gpiod_line* line = gpiod_chip_find_line(chip_.get(), wanted.c_str());
  if (line == nullptr && is_number(wanted)) {
    line = gpiod_chip_get_line(chip_.get(), static_cast<unsigned>(std::stoul(wanted)));
  }
  if (line != nullptr) return line;
  return Error{Errc::not_found, fmt::format("{}: has no line \"{}\" for [gpio] {}; it has {}", name_, wanted, purpose,
                                            line_names_of(chip_.get()))};
}

Result<void> KernelGpioLines::request_line(gpiod_line* line, const char* purpose, const std::string& wanted, int type,
                                           int flags) {
  const gpiod_line_request_config config{kConsumer, type, flags};
  if (gpiod_line_request(line, &config, 0) == 0) {
    used_ += fmt::format(", {} on {}", purpose, wanted);
    return {};
  }
  const int error = errno;
  if (error == ENODEV) return gone();
  if (error == EBUSY) {
    const char* who = gpiod_line_consumer(line);
    return Error{Errc::in_use, fmt::format("{}: line {} for [gpio] {} is held by {}", name_, wanted, purpose,
                                           who == nullptr ? "another program" : who)};
  }
  if (error == EACCES || error == EPERM) {
    return Error{Errc::unreadable, fmt::format("{}: line {} for [gpio] {} is not allowed", name_, wanted, purpose)};
  }
  return Error{
      Errc::unsupported,
      fmt::format("{}: line {} cannot be used for [gpio] {}: no interrupts, no such bias, or of the other direction",
                  name_, wanted, purpose)};
}

Result<void> KernelGpioLines::request_input(GpioInput input, const std::string& wanted, bool active_low,
                                            GpioBias bias) {
  if (wanted.empty()) return {};
  const char* purpose = input == GpioInput::strobe ? "strobe" : "pedal";
  const auto line = find(purpose, wanted);
  if (!line) return line.error();
  int flags = active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
  if (bias == GpioBias::pull_up) flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP;
  if (bias == GpioBias::pull_down) flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN;
  if (auto got = request_line(*line, purpose, wanted, GPIOD_LINE_REQUEST_EVENT_BOTH_EDGES, flags); !got) return got;
  const int fd = gpiod_line_event_get_fd(*line);
  (void)::fcntl(fd, F_SETFL, ::fcntl(fd, F_GETFL) | O_NONBLOCK);
  const int level = gpiod_line_get_value(*line);
  if (level < 0) return gone();
  // A pedal that is down already has been pressed for something else.
  if (input == GpioInput::pedal) pedal_ = Debouncer(pedal_hold_, level != 0);
  inputs_.push_back({input, *line, fd, level != 0});
  return {};
}

Result<void> KernelGpioLines::request_output(gpiod_line*& line, const char* purpose, const std::string& wanted,
                                             bool active_low) {
  if (wanted.empty()) return {};
  const auto found = find(purpose, wanted);
  if (!found) return found.error();
  const int flags = active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
  if (auto got = request_line(*found, purpose, wanted, GPIOD_LINE_REQUEST_DIRECTION_OUTPUT, flags); !got) return got;
  line = *found;
  return {};
}

/// A kernel older than 6.6 does not wake who waits for a chip that goes: it says so only when asked anew.
Result<void> KernelGpioLines::wait(Deadline until, std::array<pollfd, 2>& entries) {
  for (std::size_t i = 0; i < inputs_.size(); ++i) entries[i] = {inputs_[i].fd, POLLIN | POLLPRI, 0};
  wait_ready(std::span(entries).first(inputs_.size()), until);
  for (const pollfd& entry : entries) {
    if ((entry.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) return gone();
  }
  return {};
}

Result<void> KernelGpioLines::drain(InputLine& line, std::vector<GpioEdge>& edges) {
  std::array<gpiod_line_event, kKernelQueue> events{};
  const int count = gpiod_line_event_read_fd_multiple(line.fd, events.data(), events.size());
  if (count < 0) return errno == EAGAIN || errno == EINTR ? Result<void>() : gone();
  flooded_ = flooded_ || count == static_cast<int>(events.size());
  for (int i = 0; i < count; ++i) {
    const gpiod_line_event& event = events[static_cast<std::size_t>(i)];
    take(line, event.event_type == GPIOD_LINE_EVENT_RISING_EDGE,
         {event.ts.tv_sec * std::int64_t{1'000'000'000} + event.ts.tv_nsec}, edges);
  }
  return {};
}

void KernelGpioLines::take(InputLine& line, bool active, DeviceTime at, std::vector<GpioEdge>& edges) {
  ++counters_.edges;
  if (line.last == active) ++counters_.lost;
  line.last = active;
  if (line.input == GpioInput::strobe) {
    edges.push_back({GpioInput::strobe, active, at});
    return;
  }
  if (const auto change = pedal_.settle(at)) edges.push_back({GpioInput::pedal, change->active, change->at});
  pedal_.push(active, at);
}

/// Looks at the pedal itself once it is still: the edge that would have said so may be one that the kernel dropped.
Result<void> KernelGpioLines::settle_pedal(std::vector<GpioEdge>& edges) {
  const DeviceTime time = device_now();
  if (!pedal_.due() || time < *pedal_.due()) return {};
  for (const InputLine& line : inputs_) {
    if (line.input != GpioInput::pedal) continue;
    const int level = gpiod_line_get_value(line.line);
    if (level < 0) return gone();
    if ((level != 0) != pedal_.level()) pedal_.push(level != 0, time);
  }
  if (const auto change = pedal_.settle(time)) edges.push_back({GpioInput::pedal, change->active, change->at});
  return {};
}

Result<void> KernelGpioLines::still_there() const {
  for (const InputLine& line : inputs_) {
    if (gpiod_line_get_value(line.line) < 0) return gone();
  }
  return {};
}

Result<std::vector<GpioEdge>> KernelGpioLines::read(Deadline deadline) {
  std::vector<GpioEdge> edges;
  if (std::exchange(flooded_, false)) sleep_until(std::min(Deadline::after(kFloodPause), deadline));
  for (;;) {
    std::array<pollfd, 2> entries{};
    const auto due = pedal_.due();
    if (auto waited = wait(due ? std::min(Deadline(*due), deadline) : deadline, entries); !waited)
      return waited.error();
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      if ((entries[i].revents & (POLLIN | POLLPRI)) == 0) continue;
      if (auto drained = drain(inputs_[i], edges); !drained) return drained.error();
    }
    if (auto settled = settle_pedal(edges); !settled) return settled.error();
    if (!edges.empty()) break;
    if (!deadline.passed()) continue;
    if (auto there = still_there(); !there) return there.error();
    break;
  }
  std::stable_sort(edges.begin(), edges.end(), [](const GpioEdge& a, const GpioEdge& b) { return a.at < b.at; });
  return edges;
}

Result<void> KernelGpioLines::set(gpiod_line* line, bool on) {
  if (line == nullptr || gpiod_line_set_value(line, on ? 1 : 0) == 0) return {};
  if (errno == ENODEV) return gone();
  return Error{Errc::io, fmt::format("{}: an output cannot be set", name_)};
}

}  // namespace

Result<std::unique_ptr<GpioLines>> GpioLines::open(const GpioSettings& settings) {
  utsname kernel{};
  if ((!settings.strobe.empty() || !settings.pedal.empty()) &&
      (::uname(&kernel) != 0 || !stamps_edges_monotonic(kernel.release))) {
    return Error{Errc::unsupported,
                 fmt::format("Linux {}: its edges are not stamped with CLOCK_MONOTONIC; 5.7 or later is needed",
                             kernel.release)};
  }
  auto chip = open_gpio_chip(settings.chip);
  if (!chip) return chip.error();
  auto lines = std::make_unique<KernelGpioLines>(*std::move(chip), settings);
  if (auto got = lines->request(settings); !got) return got.error();
  return std::unique_ptr<GpioLines>(std::move(lines));
}

}  // namespace birdseye::drivers
