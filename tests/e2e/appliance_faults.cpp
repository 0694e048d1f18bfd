#include "tests/e2e/appliance_faults.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "device/wire/json.hpp"
#include "drivers/system/unique_fd.hpp"
#include "hw-sim/minibird/pseudo_terminal.hpp"

namespace birdseye::testing {

namespace {

using Problems = std::vector<std::string>;

constexpr double kDeadlineS = 30;

/// A client that says what it likes and reads nothing.
class RudeClient {
 public:
  explicit RudeClient(int port) : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const int small = 4096;
    ::setsockopt(fd_.get(), SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = ::connect(fd_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  [[nodiscard]] bool connected() const { return connected_; }
  void say(const std::string& bytes) const { (void)!::send(fd_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL); }

 private:
  UniqueFd fd_;
  bool connected_ = false;
};

/// A serial device that sends back what it is sent.
class Echo {
 public:
  explicit Echo(const std::filesystem::path& path) {
    auto terminal = hw_sim::PseudoTerminal::open(path);
    if (!terminal) return;
    terminal_.emplace(*std::move(terminal));
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        pollfd entry{terminal_->fd(), POLLIN, 0};
        if (::poll(&entry, 1, 20) <= 0) continue;
        terminal_->write(terminal_->read());
      }
    });
  }

 private:
  std::optional<hw_sim::PseudoTerminal> terminal_;
  std::jthread thread_;
};

template <typename T>
const T* newest(const FaultRig& rig) {
  return rig.seen().empty() ? nullptr : std::get_if<T>(&rig.seen().back().event);
}

std::function<bool()> health(const FaultRig& rig, std::function<bool(const wire::Health&)> wanted) {
  return [&rig, wanted = std::move(wanted)] {
    const auto* told = newest<wire::Health>(rig);
    return told != nullptr && wanted(*told);
  };
}

std::function<bool()> status(const FaultRig& rig, const std::string& words) {
  return [&rig, words] {
    const auto* told = newest<wire::Status>(rig);
    return told != nullptr && !told->ok && told->text.find(words) != std::string::npos;
  };
}

std::function<bool()> posed_frame(const FaultRig& rig) {
  return [&rig] {
    const auto* frame = newest<wire::VideoFrame>(rig);
    return frame != nullptr && frame->info.pose.kind != PoseKind::refused;
  };
}

class Befalling {
 public:
  Befalling(FaultRig::Settings settings, Problems& problems) : rig_(std::move(settings)), problems_(problems) {}

  FaultRig& rig() { return rig_; }
  void expect(const std::string& what, const std::function<bool()>& until) {
    if (!rig_.listen(kDeadlineS, until)) problems_.push_back(fmt::format("{}; {}", what, rig_.log()));
  }
  /// How long it takes until that is so.
  double time(const std::string& what, const std::function<bool()>& until) {
    const std::int64_t began_ns = monotonic_ns();
    expect(what, until);
    return static_cast<double>(monotonic_ns() - began_ns) * 1e-9;
  }
  /// The part of an instrument's rate that came in the two seconds from now on, in percent.
  double frames_percent() { return percent<wire::VideoFrame>(FaultRig::kFrameRateHz); }
  double birds_percent() { return percent<wire::Birds>(FaultRig::kTrackerRateHz); }

 private:
  template <typename T>
  double percent(double rate_hz) {
    constexpr int kTries = 10;  // a machine that stands still
    double best = 0;
    for (int i = 0; i < kTries && best < 90; ++i) {
      const std::size_t begin = rig_.seen().size();
      const std::int64_t began_ns = monotonic_ns();
      rig_.listen(2);
      const double seconds = static_cast<double>(monotonic_ns() - began_ns) * 1e-9;
      const auto count = std::count_if(rig_.seen().begin() + static_cast<std::ptrdiff_t>(begin), rig_.seen().end(),
                                       [](const Seen& seen) { return std::holds_alternative<T>(seen.event); });
      best = std::max(best, std::min(100.0, 100 * static_cast<double>(count) / (rate_hz * seconds)));
    }
    if (best < 90) problems_.push_back(fmt::format("only {:.0f} % of the rate meanwhile", best));
    return best;
  }

  FaultRig rig_;
  Problems& problems_;
};

FaultRow slow_client(const std::filesystem::path& folder, Problems& problems) {
  Befalling run({.folder = folder, .size = "640x480"}, problems);
  run.expect("no pose at first", posed_frame(run.rig()));
  const RudeClient slow(run.rig().port());
  run.expect("it was not taken", health(run.rig(), [](const wire::Health& h) { return h.clients == 2; }));
  FaultRow row;
  run.expect("nothing was shed", health(run.rig(), [](const wire::Health& h) { return h.messages_shed > 0; }));
  row.others_percent = run.frames_percent();
  run.expect("it was not put out", health(run.rig(), [](const wire::Health& h) { return h.clients == 1; }));
  row.seen = "its frames are shed, Health `messages_shed`; after 10 s without progress it is put out, Health `clients`";
  return row;
}

FaultRow garbage_client(const std::filesystem::path& folder, Problems& problems) {
  Befalling run({.folder = folder}, problems);
  run.expect("no pose at first", posed_frame(run.rig()));
  const RudeClient rude(run.rig().port());
  rude.say("GET / HTTP/1.1\r\nHost: here\r\nUser-Agent: somebody who took this port for another one\r\n\r\n");
  FaultRow row;
  row.seen = "put out, Health `requests_refused`";
  run.expect("not counted", health(run.rig(), [](const wire::Health& h) { return h.requests_refused > 0; }));
  row.others_percent = run.frames_percent();
  return row;
}

FaultRow broken_configuration(const std::filesystem::path& folder, Problems& problems) {
  Befalling run({.folder = folder}, problems);
  run.expect("no pose at first", posed_frame(run.rig()));
  std::ofstream(run.rig().config_path()) << "[tracker]\ndevice = 7\nbirds = 99\n";
  run.rig().birdseyed().signal(SIGHUP);
  FaultRow row;
  row.seen = "log: `configuration not taken, going on with the one before`, and every fault with its line";
  row.others_percent = run.frames_percent();
  if (run.rig().log().find("configuration not taken, going on with the one before") == std::string::npos ||
      run.rig().log().find("cart.toml:2") == std::string::npos) {
    problems.push_back("not said: " + run.rig().log());
  }
  run.expect("no pose after it", posed_frame(run.rig()));
  return row;
}

FaultRow absent_camera(const std::filesystem::path& folder, Problems& problems) {
  Befalling run({.folder = folder, .camera = false}, problems);
  FaultRow row;
  row.seen = "STATUS \"no camera listens there; see [camera] source\"";
  run.expect("not named", status(run.rig(), "no camera listens there; see [camera] source"));
  run.expect("no birds", [&] { return newest<wire::Birds>(run.rig()) != nullptr; });
  row.others_percent = run.birds_percent();
  run.rig().start_camera();
  row.recovery_s = run.time("no frame with a pose", posed_frame(run.rig()));
  return row;
}

FaultRow echoing_device(const std::filesystem::path& folder, Problems& problems) {
  std::filesystem::create_directories(folder);
  auto echo = std::make_unique<Echo>(folder / "tty");
  Befalling run({.folder = folder, .tracker = false}, problems);
  FaultRow row;
  row.seen = "STATUS \"this is no miniBIRD: it sends back what it is sent\"";
  run.expect("not named", status(run.rig(), "this is no miniBIRD: it sends back what it is sent"));
  row.others_percent = run.frames_percent();
  echo.reset();
  run.rig().start_tracker();
  row.recovery_s = run.time("no frame with a pose", posed_frame(run.rig()));
  return row;
}

FaultRow full_disk(const std::filesystem::path& folder, Problems& problems) {
  // A file may not become larger than some MB: to the program the same as a disk without room.
  Befalling run({.folder = folder,
                 .more = fmt::format("[record]\nfolder = \"{}\"\n", (folder / "recordings").string()),
                 .within = {"sh", "-c", "trap '' XFSZ; ulimit -f 8192; exec \"$@\"", "sh"}},
                problems);
  FaultRow row;
  row.seen = "Health `recording`: \"ended, the disk takes no more\"";
  run.expect("not said", health(run.rig(), [](const wire::Health& h) {
               return h.recording.find("ended, the disk takes no more") != std::string::npos;
             }));
  row.others_percent = run.frames_percent();
  run.expect("no pose after it", posed_frame(run.rig()));
  return row;
}

}  // namespace

std::vector<ApplianceFault> appliance_faults() {
  return {
      {"a client that does not read", "connects, reads nothing, for over 10 s", slow_client},
      {"a client that sends garbage", "an HTTP request to the port", garbage_client},
      {"a broken configuration at SIGHUP", "a wrong type, a value out of range, sections missing",
       broken_configuration},
      {"no camera at the start", "its simulator is started later", absent_camera},
      {"a serial device that is something else", "a terminal that echoes, replaced by a tracker", echoing_device},
      {"a disk that is full", "files may not grow over some MB", full_disk},
  };
}

}  // namespace birdseye::testing
