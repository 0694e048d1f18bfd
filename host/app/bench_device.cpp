#include <fmt/format.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <set>

#include "calibration/base/median.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/interrupt.hpp"
#include "drivers/system/thread.hpp"
#include "drivers/system/wait.hpp"
#include "host/app/commands.hpp"
#include "host/bench/bench_device_rig.hpp"
#include "host/bench/bench_machine.hpp"
#include "host/bench/bench_wakes.hpp"
#include "host/files/write_files.hpp"

namespace birdseye::host {

namespace {

struct BenchDeviceOptions {
  std::filesystem::path json;
  double seconds = 60;
  int clients = 2;
};

double seconds_since(HostTime begin) {
  return (host_now() - begin).seconds();
}

/// Everything one client is told until it is stopped, on a thread of its own; frames without their pixels.
class Listener {
 public:
  explicit Listener(std::unique_ptr<wire::Client> client) : client_(std::move(client)) {
    thread_ = OwnedThread([this](const std::stop_token& stop) { run(stop); });
  }
  ~Listener() { stop(); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  void stop() {
    thread_.request_stop();
    thread_.join();
  }
  /// Whether a frame with a pose has come by now.
  [[nodiscard]] bool posed() const { return posed_; }

  struct Heard {
    wire::FrameInfo info;
    DeviceTime at;
  };
  // To be read once it is stopped.
  std::vector<Heard> frames;
  std::vector<DeviceTime> birds;     ///< acquired
  std::vector<DeviceTime> birds_at;  ///< came
  std::vector<wire::Health> healths;
  std::optional<Error> ended;

 private:
  void run(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      auto event = client_->next(Deadline::after(Duration::from_ms(100)));
      if (!event) {
        ended = event.error();
        return;
      }
      if (!*event) continue;
      const DeviceTime now = device_now();  // the appliance runs on this machine
      if (auto* frame = std::get_if<wire::VideoFrame>(&**event)) {
        frames.push_back({std::move(frame->info), now});
        posed_ = posed_ || frames.back().info.pose.tracker_from_sensor.has_value();
      } else if (const auto* some = std::get_if<wire::Birds>(&**event)) {
        birds.push_back(some->acquired);
        birds_at.push_back(now);
      } else if (auto* health = std::get_if<wire::Health>(&**event)) {
        healths.push_back(std::move(*health));
      }
    }
  }
  std::unique_ptr<wire::Client> client_;
  std::atomic<bool> posed_ = false;
  OwnedThread thread_;
};

/// clients that take everything; then, where they are wanted, one that takes poses alone.
Result<std::vector<std::unique_ptr<Listener>>> listen(const DeviceRig& rig, int clients, bool poses_alone) {
  std::vector<std::unique_ptr<Listener>> listeners;
  for (int i = 0; i < clients; ++i) {
    auto client = wire::Client::connect("127.0.0.1", rig.port(), Deadline::after(Duration::from_seconds(15)));
    if (!client) return client.error();
    listeners.push_back(std::make_unique<Listener>(*std::move(client)));
  }
  if (poses_alone) {
    auto client = wire::Client::connect("127.0.0.1", rig.port(), Deadline::after(Duration::from_seconds(15)));
    if (!client) return client.error();
    if (auto told =
            (*client)->subscribe({.frames = false, .tracking = true}, Deadline::after(Duration::from_seconds(1)));
        !told)
      return told.error();
    listeners.push_back(std::make_unique<Listener>(*std::move(client)));
  }
  for (const auto deadline = Deadline::after(Duration::from_seconds(30)); !listeners.front()->posed();) {
    if (deadline.passed()) return Error{Errc::timeout, "no frame with a pose came within 30 s; see birdseyed.log"};
    sleep_for(Duration::from_ms(20));
  }
  return listeners;
}

/// The instruments, birdseyed, and those who listen to it.
struct Session {
  static Result<Session> start(const DeviceRigSettings& settings, int clients, bool poses_alone = false) {
    auto rig = DeviceRig::start(settings);
    if (!rig) return rig.error();
    auto listeners = listen(**rig, clients, poses_alone);
    if (!listeners) return listeners.error();
    return Session{*std::move(rig), *std::move(listeners)};
  }
  std::unique_ptr<DeviceRig> rig;
  std::vector<std::unique_ptr<Listener>> listeners;
};

void sleep_unless_interrupted(double s) {
  for (const HostTime begin = host_now(); seconds_since(begin) < s && !interrupted();) sleep_for(Duration::from_ms(50));
}

double thread_cpu_s() {
  timespec used{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

/// Processor seconds that nothing but copying one frame's pixels in from a Unix socket and out to so many others takes,
/// here and now: what any program that passes frames on must spend.
double copy_s_per_frame(std::size_t bytes, int outputs) {
  constexpr int kFrames = 40;
  std::vector<std::uint8_t> from(bytes, 7), into(bytes);
  double spent_s = 0;
  for (int direction = 0; direction <= outputs; ++direction) {
    int pair[2];
    if (::socketpair(AF_UNIX, SOCK_STREAM, 0, pair) != 0) return 0;
    std::vector<std::uint8_t> theirs(bytes, 3);
    const auto send_all = [&](int fd, const std::vector<std::uint8_t>& data) {
      for (std::size_t at = 0; at < data.size();) {
        const ssize_t put = ::send(fd, data.data() + at, std::min<std::size_t>(data.size() - at, 256U << 10U), 0);
        if (put <= 0) return;
        at += static_cast<std::size_t>(put);
      }
    };
    const auto receive_all = [&](int fd, std::vector<std::uint8_t>& data) {
      for (std::size_t at = 0; at < data.size();) {
        const ssize_t got = ::recv(fd, data.data() + at, data.size() - at, 0);
        if (got <= 0) return;
        at += static_cast<std::size_t>(got);
      }
    };
    OwnedThread other([&](const std::stop_token&) {
      for (int i = 0; i < kFrames; ++i) direction == 0 ? send_all(pair[1], theirs) : receive_all(pair[1], theirs);
    });
    const double before_s = thread_cpu_s();
    for (int i = 0; i < kFrames; ++i) direction == 0 ? receive_all(pair[0], into) : send_all(pair[0], from);
    spent_s += (thread_cpu_s() - before_s) / kFrames;
    other.join();
    ::close(pair[0]);
    ::close(pair[1]);
  }
  return spent_s;
}

std::uint64_t holes(const std::vector<Listener::Heard>& frames) {
  std::uint64_t missing = 0;
  for (std::size_t i = 1; i < frames.size(); ++i) missing += frames[i].info.sequence - frames[i - 1].info.sequence - 1;
  return missing;
}

/// Tracker at its highest rate and 1080p60 to several clients.
Result<void> measure_load(const BenchDeviceOptions& options, const std::filesystem::path& folder, nlohmann::json& out) {
  DeviceRigSettings settings;
  settings.folder = folder / "load";
  auto session = Session::start(settings, options.clients, true);
  if (!session) return session.error();
  const DeviceRig& rig = *session->rig;
  const auto wakes = TwoWakes::start();
  if (!wakes) return wakes.error();
  sleep_unless_interrupted(2);
  const HostTime begin = host_now();
  const double cpu_before_s = rig.cpu_s(), memory_before_mb = rig.resident_mb();
  double most_mb = memory_before_mb;
  while (seconds_since(begin) < options.seconds && !interrupted()) {
    sleep_unless_interrupted(1);
    most_mb = std::max(most_mb, rig.resident_mb());
  }
  const double elapsed_s = seconds_since(begin);
  const double cpu_percent = 100 * (rig.cpu_s() - cpu_before_s) / elapsed_s;
  const double memory_mb = rig.resident_mb();
  const std::vector<double> p99_wakes = (*wakes)->stop();
  std::uint64_t frames_lost = 0;
  for (auto& listener : session->listeners) {
    listener->stop();
    if (listener->ended) return *listener->ended;
    frames_lost += holes(listener->frames);
  }
  const Listener& first = *session->listeners.front();
  std::vector<double> p99_tracker, p99_beside, p99_frame;
  for (std::size_t i = 3; i < first.healths.size(); ++i) {
    p99_tracker.push_back(first.healths[i].latency_ms_p99_tracker);
    p99_beside.push_back(first.healths[i].latency_ms_p99_tracker_beside_frames);
    p99_frame.push_back(first.healths[i].latency_ms_p99_frame);
  }
  if (p99_tracker.empty()) return Error{Errc::timeout, "no report of health came; give --seconds of 10 or more"};
  const wire::Health& last = first.healths.back();
  const double copy_percent =
      100 * settings.video_rate_hz * copy_s_per_frame(std::size_t{1920} * 1080 * 3, options.clients);
  out["tracker_hz"] = last.tracker_rate_hz;
  out["frame_hz"] = last.frame_rate_hz;
  out["records_lost"] = last.measurements_lost + last.senseless_records + last.phase_errors;
  out["measurements"] = last.measurements;
  out["frames_lost"] = frames_lost + last.messages_shed;
  out["clients_shed"] = last.clients_shed;
  out["frames"] = last.frames;
  out["cpu_percent_total"] = cpu_percent;
  out["cpu_percent_pixel_copy"] = copy_percent;
  out["cpu_percent"] = std::max(0.0, cpu_percent - copy_percent);
  out["latency_ms_p99_tracker"] = median_of(p99_tracker);  // of each second's
  out["latency_ms_p99_tracker_beside_frames"] = median_of(p99_beside);
  out["latency_ms_p99_frame"] = median_of(p99_frame);
  out["latency_ms_p99_two_wakes"] = median_of(p99_wakes);  // of threads that do nothing, in the same seconds
  out["resident_mb"] = memory_mb;
  out["resident_mb_max"] = most_mb;
  out["resident_mb_growth"] = memory_mb - memory_before_mb;
  out["load_s"] = elapsed_s;
  return {};
}

/// How far the pose that a frame came with is, in time, from the frame: the simulated sensor goes round a circle, so a
/// pose tells when it was.
Result<void> measure_time(const BenchDeviceOptions& options, const std::filesystem::path& folder, nlohmann::json& out) {
  DeviceRigSettings settings;
  settings.folder = folder / "time";
  settings.tracker_rate_hz = 103.3;
  settings.width_px = 320;
  settings.height_px = 240;
  settings.video_rate_hz = 30;
  settings.jitter_ms = 5;
  settings.drift_ppm = 50;
  settings.stamps = false;
  auto session = Session::start(settings, 1);
  if (!session) return session.error();
  const DeviceRig& rig = *session->rig;
  sleep_unless_interrupted(std::clamp(options.seconds / 2, 10.0, 60.0));
  Listener& listener = *session->listeners.front();
  listener.stop();
  const auto tracker = rig.tracker_truth(), camera = rig.camera_truth();
  if (!tracker || !camera) return tracker ? camera.error() : tracker.error();
  constexpr double kTurn_s = 2, kQuantum_s = 0.00005;  // half a count of 0.11 mm at 628 mm/s
  double squares = 0;
  std::size_t count = 0, within_1 = 0, within_2 = 0;
  for (const auto& [info, at] : listener.frames) {
    if (!info.pose.tracker_from_sensor) continue;
    const Eigen::Vector3d p = info.pose.tracker_from_sensor->translation();
    const double pose_s = std::atan2(p.y(), p.x() - 400) / (2 * std::numbers::pi) * kTurn_s;
    const double frame_s = static_cast<double>(camera->zero_ns - tracker->zero_ns) * 1e-9 +
                           static_cast<double>(info.sequence) / camera->rate_hz;
    const double error_s = std::remainder(pose_s - frame_s, kTurn_s);
    const double sigma_s = std::hypot(info.acquired_sigma.seconds(), info.pose.time_sigma.seconds(), kQuantum_s);
    squares += error_s * error_s;
    ++count;
    within_1 += std::abs(error_s) <= sigma_s ? 1 : 0;
    within_2 += std::abs(error_s) <= 2 * sigma_s ? 1 : 0;
  }
  if (count < 100) return Error{Errc::timeout, "too few frames had a pose to judge their times"};
  const auto n = static_cast<double>(count);
  out["time_error_ms_rms"] = 1e3 * std::sqrt(squares / n);
  out["sigma_coverage_68"] = static_cast<double>(within_1) / n;
  out["sigma_coverage_95"] = static_cast<double>(within_2) / n;
  out["time_frames"] = count;
  out["time_frames_refused"] = listener.frames.size() - count;
  return {};
}

/// From the end of each fault to the first message of that instrument that is good again.
Result<void> measure_recovery(const std::filesystem::path& folder, nlohmann::json& out) {
  DeviceRigSettings settings;
  settings.folder = folder / "recovery";
  settings.width_px = 320;
  settings.height_px = 240;
  settings.video_rate_hz = 30;
  settings.noise_mm = 0.1;
  settings.tracker_faults =
      "[[fault]]\nname = \"stuck_stream\"\nat_s = 4\nfor_s = 1\n[[fault]]\nname = \"unplug\"\nat_s = 12\nfor_s = 1\n"
      "[[fault]]\nname = \"line_noise\"\nat_s = 20\nfor_s = 1\nchance = 0.5\n[[fault]]\nname = \"saturated\"\nat_s = "
      "24\n"
      "for_s = 1\n[[fault]]\nname = \"hemisphere_flip\"\nat_s = 28\nfor_s = 1\n";
  settings.camera_faults =
      "[[fault]]\nname = \"silence\"\nat_s = 8\nfor_s = 1\n[[fault]]\nname = \"unplug\"\nat_s = 16\nfor_s = 1\n";
  auto session = Session::start(settings, 1);
  if (!session) return session.error();
  const DeviceRig& rig = *session->rig;
  sleep_unless_interrupted(33);
  Listener& listener = *session->listeners.front();
  listener.stop();
  double worst_s = 0;
  out["recovery_s"] = nlohmann::json::object();
  const std::set<std::string> of_camera{"silence"};
  for (const FaultEvent& fault : rig.faults()) {
    if (fault.begins) continue;
    const auto after = [&](const auto& times, const auto& time_of) {
      for (const auto& one : times) {
        if (time_of(one) > fault.at) return (time_of(one) - fault.at).seconds();
      }
      return 1e9;
    };
    // Both instruments have a fault called unplug, and the event does not say whose it was. Take the later of the two
    // recoveries.
    const double poses_s = after(listener.birds_at, [](DeviceTime t) { return t; });
    const double frames_s = after(listener.frames, [](const Listener::Heard& f) { return f.at; });
    const double took_s = of_camera.count(fault.name) != 0 ? frames_s : std::max(poses_s, frames_s);
    out["recovery_s"][fault.name] = std::max(out["recovery_s"].value(fault.name, 0.0), took_s);
    worst_s = std::max(worst_s, took_s);
  }
  if (out["recovery_s"].size() < 5) return Error{Errc::timeout, "not all faults came to pass; see the logs"};
  out["recovery_s_max"] = worst_s;
  return {};
}

Result<void> bench_device(const BenchDeviceOptions& options) {
  note_interrupts();
  const auto folder = std::filesystem::temp_directory_path() / fmt::format("birdseye-bench-device-{}", ::getpid());
  nlohmann::json out;
  out["machine"] = bench_machine();
  out["clients"] = options.clients;
  for (const auto& step : {std::function<Result<void>()>([&] { return measure_load(options, folder, out); }),
                           std::function<Result<void>()>([&] { return measure_time(options, folder, out); }),
                           std::function<Result<void>()>([&] { return measure_recovery(folder, out); })}) {
    if (auto done = step(); !done) return done;
    if (interrupted()) return Error{Errc::disconnected, "interrupted; nothing is left running"};
  }
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
  fmt::print("{}\n", out.dump(2));
  return write_files({{options.json, text_of(out)}});
}

}  // namespace

void add_bench_device(CLI::App& bench, CommandStatus& status) {
  const auto options = std::make_shared<BenchDeviceOptions>();
  CLI::App& device = *bench.add_subcommand("device", "birdseyed on simulated instruments: load, times, recovery");
  device.add_option("--json", options->json, "write the figures to this file");
  device.add_option("--seconds", options->seconds, "of the load (default 60)")->check(CLI::Range(10.0, 86'400.0));
  device.add_option("--clients", options->clients, "that take everything (default 2)")->check(CLI::Range(1, 8));
  device.callback([options, &status] { status.take(bench_device(*options)); });
}

}  // namespace birdseye::host
