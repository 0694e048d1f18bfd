#include "host/bench/device_study.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <string>

#include "calibration/base/median.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/interrupt.hpp"
#include "drivers/system/wait.hpp"
#include "host/bench/bench_machine.hpp"
#include "host/bench/bench_wakes.hpp"
#include "host/bench/device_session.hpp"
#include "host/bench/pixel_copy.hpp"

namespace birdseye::host {

namespace {

double seconds_since(HostTime begin) {
  return (host_now() - begin).seconds();
}

void sleep_unless_interrupted(double s) {
  for (const HostTime begin = host_now(); seconds_since(begin) < s && !interrupted();) sleep_for(Duration::from_ms(50));
}

std::uint64_t holes(const std::vector<DeviceListener::Heard>& frames) {
  std::uint64_t missing = 0;
  for (std::size_t i = 1; i < frames.size(); ++i) missing += frames[i].info.sequence - frames[i - 1].info.sequence - 1;
  return missing;
}

/// Tracker at its highest rate and 1080p60 to several clients.
Result<void> measure_load(const DeviceStudyOptions& options, const std::filesystem::path& folder, nlohmann::json& out) {
  DeviceRigSettings settings;
  settings.folder = folder / "load";
  auto session = DeviceSession::start(settings, options.clients, true);
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
  const DeviceListener& first = *session->listeners.front();
  std::vector<double> p99_tracker, p99_beside, p99_frame;
  for (std::size_t i = 3; i < first.healths.size(); ++i) {
    p99_tracker.push_back(first.healths[i].latency_ms_p99_tracker);
    p99_beside.push_back(first.healths[i].latency_ms_p99_tracker_beside_frames);
    p99_frame.push_back(first.healths[i].latency_ms_p99_frame);
  }
  if (p99_tracker.empty()) return Error{Errc::timeout, "no report of health came; give --seconds of 10 or more"};
  const wire::Health& last = first.healths.back();
  const auto copy_s = copy_s_per_frame(std::size_t{1920} * 1080 * 3, options.clients);
  if (!copy_s) return copy_s.error();
  const double copy_percent = 100 * settings.video_rate_hz * *copy_s;
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
Result<void> measure_time(const DeviceStudyOptions& options, const std::filesystem::path& folder, nlohmann::json& out) {
  DeviceRigSettings settings;
  settings.folder = folder / "time";
  settings.tracker_rate_hz = 103.3;
  settings.width_px = 320;
  settings.height_px = 240;
  settings.video_rate_hz = 30;
  settings.jitter_ms = 5;
  settings.drift_ppm = 50;
  settings.stamps = false;
  auto session = DeviceSession::start(settings, 1);
  if (!session) return session.error();
  const DeviceRig& rig = *session->rig;
  sleep_unless_interrupted(std::clamp(options.seconds / 2, 10.0, 60.0));
  DeviceListener& listener = *session->listeners.front();
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
  auto session = DeviceSession::start(settings, 1);
  if (!session) return session.error();
  const DeviceRig& rig = *session->rig;
  sleep_unless_interrupted(33);
  DeviceListener& listener = *session->listeners.front();
  listener.stop();
  double worst_s = 0;
  out["recovery_s"] = nlohmann::json::object();
  const std::set<std::string> of_camera{"silence"};
  for (const FaultTruth& fault : rig.faults()) {
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
    const double frames_s = after(listener.frames, [](const DeviceListener::Heard& f) { return f.at; });
    const double took_s = of_camera.count(fault.name) != 0 ? frames_s : std::max(poses_s, frames_s);
    out["recovery_s"][fault.name] = std::max(out["recovery_s"].value(fault.name, 0.0), took_s);
    worst_s = std::max(worst_s, took_s);
  }
  if (out["recovery_s"].size() < 5) return Error{Errc::timeout, "not all faults came to pass; see the logs"};
  out["recovery_s_max"] = worst_s;
  return {};
}

}  // namespace

Result<nlohmann::json> device_study(const DeviceStudyOptions& options) {
  const auto folder = std::filesystem::temp_directory_path() / fmt::format("birdseye-bench-device-{}", ::getpid());
  nlohmann::json out;
  out["machine"] = bench_machine();
  out["clients"] = options.clients;
  for (const auto& step : {std::function<Result<void>()>([&] { return measure_load(options, folder, out); }),
                           std::function<Result<void>()>([&] { return measure_time(options, folder, out); }),
                           std::function<Result<void>()>([&] { return measure_recovery(folder, out); })}) {
    if (auto done = step(); !done) return done.error();
    if (interrupted()) return Error{Errc::disconnected, "interrupted; nothing is left running"};
  }
  std::error_code ignored;
  std::filesystem::remove_all(folder, ignored);
  return out;
}

}  // namespace birdseye::host
