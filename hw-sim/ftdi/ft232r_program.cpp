#include "hw-sim/ftdi/ft232r_program.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <nlohmann/json.hpp>

#include "drivers/system/clock.hpp"
#include "drivers/system/unique_fd.hpp"
#include "drivers/system/wait.hpp"
#include "hw-sim/faults/announce.hpp"
#include "hw-sim/ftdi/usb_redir.hpp"
#include "hw-sim/minibird/motion.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr Duration kLongestWait = Duration::from_ms(50);

void tell(nlohmann::json event) {
  event["monotonic_ns"] = device_now().ns;
  announce(event);
}

/// Empty while there is nobody.
Result<UniqueFd> connect(const std::filesystem::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string name = path.string();
  if (name.size() >= sizeof address.sun_path) {
    return Error{Errc::bad_value, fmt::format("{}: is too long for a socket; give --unix a shorter path", name)};
  }
  std::copy(name.begin(), name.end(), address.sun_path);
  UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return fd;
  if (errno == EACCES || errno == EPERM) {
    return Error{Errc::unreadable, fmt::format("{}: no permission to connect; see --unix", name)};
  }
  return UniqueFd();
}

bool send_all(int fd, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t put = ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (put < 0 && errno != EINTR) return false;
    if (put > 0) bytes = bytes.subspan(static_cast<std::size_t>(put));
  }
  return true;
}

/// Lines from standard input, as far as they have come.
class Commands {
 public:
  [[nodiscard]] int fd() const { return open_ ? STDIN_FILENO : -1; }
  std::vector<std::string> read() {
    std::array<char, 256> chunk;
    const ssize_t got = ::read(STDIN_FILENO, chunk.data(), chunk.size());
    open_ = got > 0 || (got < 0 && errno == EINTR);
    if (got > 0) text_.append(chunk.data(), static_cast<std::size_t>(got));
    std::vector<std::string> lines;
    for (std::size_t end = 0; (end = text_.find('\n')) != std::string::npos; text_.erase(0, end + 1))
      lines.push_back(text_.substr(0, end));
    return lines;
  }

 private:
  bool open_ = true;
  std::string text_;
};

class Bench {
 public:
  explicit Bench(const Ft232rProgram& program)
      : program_(program), chip_(chip_of(program)), tracker_(tracker_of(program)) {}

  Result<void> run(const std::atomic<bool>& stop) {
    while (!stop) {
      auto fd = connect(program_.socket);
      if (!fd) return fd.error();
      if (!*fd) {
        wait(-1, device_now() + kLongestWait);
        continue;
      }
      UsbRedir usb(chip_);
      usb_ = &usb;
      follow_cable();
      serve(fd->get(), stop);
      usb_ = nullptr;
    }
    return {};
  }

 private:
  void serve(int fd, const std::atomic<bool>& stop) {
    bool told = false;
    while (!stop) {
      const DeviceTime time = device_now();
      move_bytes(time);
      usb_->pump(time);
      if (!send_all(fd, usb_->output())) return;
      if (!told && usb_->plugged()) {
        told = true;
        tell({{"event", "ready"}});
      }
      if (!wait(fd, next_event(time))) continue;
      std::array<std::uint8_t, 65536> chunk;
      const ssize_t got = ::recv(fd, chunk.data(), chunk.size(), MSG_DONTWAIT);
      if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) return;
      if (got < 0) continue;
      if (auto taken = usb_->receive(std::span(chunk.data(), static_cast<std::size_t>(got)), device_now()); !taken) {
        tell({{"event", "refused"}, {"reason", taken.error().what}});
        wait(-1, device_now() + Duration::from_ms(1000));
        return;
      }
      watch_lines();
    }
  }

  void move_bytes(DeviceTime time) {
    if (const auto sent = chip_.sent(time); !sent.empty()) tracker_.receive(sent, time.ns);
    for (const Delivery& delivery : tracker_.advance(time.ns)) {
      if (delivery.line_error) chip_.damage(LineError::framing);
      chip_.receive(delivery.bytes, {delivery.due_ns});
    }
    for (const FaultEvent& event : tracker_.take_events()) announce(event);
    if (tracker_.plugged() == pulled_by_script_) {
      pulled_by_script_ = !tracker_.plugged();
      follow_cable();
    }
  }

  DeviceTime next_event(DeviceTime time) const {
    DeviceTime next = std::min(time + kLongestWait, DeviceTime{tracker_.next_ns()});
    if (const auto sent = chip_.next_sent()) next = std::min(next, *sent);
    if (const auto due = usb_->next_event()) next = std::min(next, *due);
    return next;
  }

  /// RTS is wired to the tracker's reset.
  void watch_lines() {
    if (chip_.rts() == rts_ && chip_.dtr() == dtr_) return;
    if (chip_.rts() != rts_) tracker_.set_reset(chip_.rts(), device_now().ns);
    rts_ = chip_.rts();
    dtr_ = chip_.dtr();
    tell({{"event", "lines"}, {"rts", rts_}, {"dtr", dtr_}});
  }

  /// Until there is something to read from fd; commands that come meanwhile are carried out.
  bool wait(int fd, Deadline until) {
    std::array<pollfd, 2> entries{{{fd, POLLIN, 0}, {commands_.fd(), POLLIN, 0}}};
    if (!wait_ready(entries, until)) return false;
    if (entries[1].revents != 0) {
      for (const std::string& command : commands_.read()) carry_out(command);
    }
    return entries[0].revents != 0;
  }

  void carry_out(const std::string& command) {
    constexpr std::pair<const char*, LineError> kDamage[] = {{"overrun", LineError::overrun},
                                                             {"parity", LineError::parity},
                                                             {"framing", LineError::framing},
                                                             {"break", LineError::line_break}};
    for (const auto& [name, error] : kDamage) {
      if (command == name) {
        chip_.damage(error);
        tell({{"event", "fault"}, {"name", name}, {"phase", "begin"}});
        return;
      }
    }
    if (command != "unplug" && command != "plug") {
      tell({{"event", "unknown"}, {"command", command}});
      return;
    }
    pulled_by_hand_ = command == "unplug";
    tell({{"event", "fault"}, {"name", "unplug"}, {"phase", pulled_by_hand_ ? "begin" : "end"}});
    follow_cable();
  }

  void follow_cable() {
    if (usb_ == nullptr) return;
    if (pulled_by_hand_ || pulled_by_script_) {
      usb_->unplug();
    } else {
      usb_->plug(device_now());
      watch_lines();
    }
  }

  static Ft232rSettings chip_of(const Ft232rProgram& program) {
    Ft232rSettings chip = program.chip;
    chip.line_baud = program.tracker.baud;
    return chip;
  }
  static TrackerScript tracker_of(const Ft232rProgram& program) {
    TrackerSettings settings = program.tracker;
    settings.baud = 1'000'000'000;  // its bytes take their time in the chip
    const std::int64_t now_ns = device_now().ns;
    return {settings, motion_named(program.motion, program.period_s, now_ns), now_ns};
  }

  const Ft232rProgram& program_;
  Ft232r chip_;
  TrackerScript tracker_;
  UsbRedir* usb_ = nullptr;
  Commands commands_;
  bool pulled_by_hand_ = false, pulled_by_script_ = false, rts_ = false, dtr_ = false;
};

}  // namespace

Result<void> run_ft232r(const Ft232rProgram& program, const std::atomic<bool>& stop) {
  return Bench(program).run(stop);
}

}  // namespace birdseye::hw_sim
