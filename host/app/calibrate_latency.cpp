#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "calibration/latency/latency.hpp"
#include "drivers/system/program.hpp"
#include "host/app/calibrate_commands.hpp"
#include "host/app/pose_options.hpp"
#include "host/app/results.hpp"
#include "host/calibrate/latency_advice.hpp"
#include "host/calibrate/latency_report.hpp"
#include "host/calibrate/latency_streams.hpp"
#include "host/calibrate/time_hint.hpp"
#include "host/files/column_names.hpp"
#include "host/files/pose_collector.hpp"
#include "host/files/pose_files.hpp"
#include "host/link/appliance_hardware.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using calibration::Latency;

struct CalibrateLatencyOptions {
  fs::path recording, poses, eye_poses;
  std::string server, transform, eye_transform, eye_time_unit;
  PoseOptions poses_are;
  std::optional<double> delay_ms;
  LatencySource source;
  calibration::LatencySettings settings;
  bool no_drift = false;
  ResultPaths paths;
};

struct LatencyFound {
  Latency latency;
  StreamNames names;
  std::string advice;
  nlohmann::json more = nlohmann::json::object();
  LatencySetting setting;
  Drops drops;
};

Result<LatencyFound> of_appliance(const CalibrateLatencyOptions& options, const AdmittedRecording& recording,
                                  Progress& progress) {
  Result<LatencyStreams> streams = Error{};
  if (!options.recording.empty()) {
    LatencySource all = options.source;
    all.seconds = 0;
    streams = is_session(options.recording) ? session_streams(options.recording, recording.events_sha256, all, progress)
                                            : replay_streams(options.recording, all, progress);
  } else {
    streams = record_streams(options.server, options.source, progress);
  }
  if (!streams) return std::move(streams).error();
  progress.keep(fmt::format("{} poses, {} frames", streams->tracker.size(), streams->frames));
  if (streams->video.empty()) {
    return Error{Errc::bad_value, fmt::format("no motion can be seen in any of {} frames: {}; look at something with a "
                                              "texture, such as the board, in focus and in the light",
                                              streams->frames, streams->usual_reason)};
  }
  auto latency = calibration::find_latency(std::span<const calibration::TimedMotionPose>(streams->tracker),
                                           std::span<const calibration::ImageMotion>(streams->video), options.settings);
  if (!latency) return Error{latency.error().code, latency.error().what + " (a: the tracker, b: the video)"};
  LatencyFound found{*std::move(latency),
                     {"tracker", "video", "px/s"},
                     {},
                     {},
                     {options.delay_ms, streams->in_force_ms, !options.paths.record.empty()},
                     streams->drops};
  const LatencyAdvice advice = advise_latency(found.latency, found.setting);
  found.advice = advice.text;
  found.more = {{"method", "picture motion"},
                {"bird", streams->bird},
                {"frames", streams->frames},
                {"frames_without_motion", streams->frames_without_motion}};
  if (advice.camera_delay_ms) found.more["camera_delay_ms"] = *advice.camera_delay_ms;
  if (streams->in_force_ms) found.more["record_latency_ms"] = *streams->in_force_ms;
  return found;
}

Result<PoseSet> read_timed(const fs::path& path, const PoseReading& how, Verdict& odd) {
  auto set = read_pose_set(path, how);
  if (!set) return set.error();
  if (!set->timed)
    return Error{Errc::bad_value,
                 fmt::format("{}: its poses bear no times, only an order; give a CSV with times", path.string())};
  for (const std::string& line : by_kind(set->rejected))
    odd.add(Grade::pass, fmt::format("{}: rejected {}", path.filename().string(), line));
  for (const std::string& note : set->notes) odd.add(Grade::pass, path.filename().string() + ": " + note);
  return set;
}

std::vector<calibration::TimedRotation> rotations_of(const PoseSet& set) {
  std::vector<calibration::TimedRotation> rows;
  rows.reserve(set.poses.size());
  for (const TimedPose& pose : set.poses) rows.push_back({pose.time_s, pose.tracker_from_sensor.quaternion()});
  return rows;
}

Result<LatencyFound> of_files(const CalibrateLatencyOptions& options, const AdmittedField& field, Verdict& odd) {
  PoseReading how = pose_reading(options.poses_are, field.map);
  how.transform = options.transform;
  const auto a = read_timed(options.poses, how, odd);
  if (!a) return a.error();
  const auto sensor_s_per_unit = how.s_per_unit;
  if (!options.eye_time_unit.empty()) how.s_per_unit = seconds_per(options.eye_time_unit);
  how.transform = options.eye_transform;
  how.option_prefix = "eye-";
  how.field.reset();
  how.inverted = false;
  how.most_error_mm.reset();  // what the camera saw is not the tracker's
  const auto b = read_timed(options.eye_poses, how, odd);
  if (!b) return b.error();
  if (auto two = refuse_alike(options.poses, *a, options.eye_poses, *b); !two) return two.error();
  auto latency = calibration::find_latency(rotations_of(*a), rotations_of(*b), options.settings);
  if (!latency) {
    const TimedFile of_sensor{options.poses.string(), "--time-unit", *a, sensor_s_per_unit.value_or(1)};
    const TimedFile of_eye{options.eye_poses.string(), "--eye-time-unit", *b, how.s_per_unit.value_or(1)};
    if (const std::string hint = hint_on_time_units(of_sensor, of_eye); !hint.empty())
      return Error{Errc::bad_value, hint};
    return Error{latency.error().code, latency.error().what + " (a: --poses, b: --eye-poses)"};
  }
  LatencyFound found{*std::move(latency), {"poses", "eye poses", "rad/s"}, {}, {{"method", "poses"}}, {}, {}};
  found.advice = fmt::format("the times of {} are {:.2f} ms too {} against those of {}: {} that",
                             options.eye_poses.filename().string(), std::abs(found.latency.offset_ms),
                             found.latency.offset_ms > 0 ? "late" : "early", options.poses.filename().string(),
                             found.latency.offset_ms > 0 ? "subtract" : "add");
  return found;
}

std::string out_text(const Latency& latency) {
  return fmt::format(
      "# How late frames are against the tracker, ms and ppm\noffset_ms = {:.3f}\noffset_ci95_ms = [{:.3f}, {:.3f}]\n"
      "drift_ppm = {:.2f}\ndrift_ci95_ppm = [{:.2f}, {:.2f}]\n",
      latency.offset_ms, latency.offset_ci95_ms[0], latency.offset_ci95_ms[1], latency.drift_ppm,
      latency.drift_ci95_ppm[0], latency.drift_ci95_ppm[1]);
}

std::string made_from(const CalibrateLatencyOptions& options) {
  if (!options.recording.empty()) return options.recording.filename().string();
  if (!options.server.empty()) return options.server;
  return fmt::format("{} and {}", options.poses.filename().string(), options.eye_poses.filename().string());
}

/// Refuses, by its name, what was given and would be of no effect.
Result<void> check(const CLI::App& command, const CalibrateLatencyOptions& options) {
  const bool files = !options.poses.empty();
  if (static_cast<int>(files) + static_cast<int>(!options.recording.empty()) +
              static_cast<int>(!options.server.empty()) !=
          1 ||
      files == options.eye_poses.empty()) {
    return Error{Errc::bad_value, "calibrate latency: give one of --server, --recording, or --poses with --eye-poses"};
  }
  if (files) return refuse_given(command, {"--bird", "--seconds", "--delay-ms"}, "goes with --server or --recording");
  if (auto fine = refuse_given(command, kPoseOptions, "goes with --poses"); !fine) return fine;
  if (auto fine = refuse_given(command, {"--transform", "--eye-transform", "--eye-time-unit"},
                               "goes with --poses (--bird names a bird)");
      !fine)
    return fine;
  if (options.recording.empty()) return {};
  return refuse_given(command, {"--seconds"}, "goes with --server: a recording is played to its end");
}

void run(const CLI::App& command, const CalibrateLatencyOptions& options, CommandStatus& status) {
  if (const auto fine = check(command, options); !fine) return status.refuse(fine.error());
  Progress progress;
  Verdict odd;
  const bool files = !options.poses.empty();
  if (!options.server.empty()) {
    const auto fits = check_bound_record(options.paths.record, options.server, {"tracker", "camera"});
    if (!fits) return status.refuse(fits.error());
  }
  const auto recording = admit_sources({options.recording, options.poses, options.eye_poses}, options.paths);
  if (!recording) return status.refuse(recording.error());
  const auto field = admit_field(options.poses_are.field, options.server, options.paths);
  if (!field) return status.refuse(field.error());
  const auto found = files ? of_files(options, *field, odd) : of_appliance(options, *recording, progress);
  if (!found) return status.refuse(found.error());
  Verdict verdict = calibration::latency_verdict(found->latency, found->names.a, found->names.b);
  for (const std::string& reason : odd.reasons) verdict.add(Grade::pass, reason);
  if (verdict.grade != Grade::fail) judge_in_force(found->latency, found->setting, verdict);
  found->drops.tell(verdict);
  const std::string doubt = tell_doubts(*recording, *field, verdict);
  if (verdict.grade != Grade::fail) {
    const Latency& l = found->latency;
    fmt::print("offset {:.2f} ms (95 %: {:.2f} to {:.2f}), drift {:.1f} ppm (95 %: {:.1f} to {:.1f})\n", l.offset_ms,
               l.offset_ci95_ms[0], l.offset_ci95_ms[1], l.drift_ppm, l.drift_ci95_ppm[0], l.drift_ci95_ppm[1]);
    print_line(found->advice);
  }
  nlohmann::json json = latency_json(found->latency, verdict);
  json.update(found->more);
  if (verdict.grade == Grade::fail) {
    json.erase("camera_delay_ms");
  } else {
    json["advice"] = found->advice;
  }
  finish_calibration(options.paths, out_text(found->latency), std::move(json),
                     latency_page(found->latency, verdict, found->names, found->advice), verdict, status,
                     {made_from(options),
                      [&found, &options](auto& record, const auto& provenance) {
                        const Latency& l = found->latency;
                        record.latency =
                            calibration::LatencyEntry{provenance,          l.offset_ms, l.offset_ci95_ms[0],
                                                      l.offset_ci95_ms[1], l.drift_ppm, options.delay_ms};
                      },
                      doubt});
}

}  // namespace

void add_calibrate_latency(CLI::App& calibrate, CommandStatus& status) {
  auto options = std::make_shared<CalibrateLatencyOptions>();
  CLI::App& command = *calibrate.add_subcommand(
      "latency", "how late the video's times are against the tracker's, from motion that both see");
  command.add_option("--server", options->server, "an appliance that runs: record from it now")
      ->type_name("[NAME@]HOST:PORT");
  command.add_option("--seconds", options->source.seconds, "how long to record from it (default 20)")
      ->check(CLI::Range(8.0, 600.0));
  command
      .add_option("--recording", options->recording,
                  "an appliance recording (.berec) or a session recording (a folder), played again")
      ->type_name("FILE");
  command.add_option("--bird", options->source.bird, "the bird on the scope, by its name (default scope)");
  command
      .add_option("--delay-ms", options->delay_ms,
                  "what [camera] delay_ms is now, to be told what to set; with --record it is kept, and birdseyed does "
                  "not use the record with another")
      ->check(CLI::Range(0.0, 1000.0));
  command.add_option("--poses", options->poses, "poses with times, in place of an appliance: of the tracker")
      ->type_name("FILE");
  command.add_option("--eye-poses", options->eye_poses, "of the camera, against what it looks at")->type_name("FILE");
  command.add_option("--transform,--tool", options->transform, "whose poses, where --poses holds those of several");
  command.add_option("--eye-transform,--eye-tool", options->eye_transform, "the same of --eye-poses");
  add_pose_options(command, options->poses_are);
  add_eye_time_unit(command, options->eye_time_unit);
  command.add_flag("--no-drift", options->no_drift, "both clocks are known to run at one rate");
  add_result_options(command, options->paths, "offset and drift (TOML)");
  allow_unsigned_sources(command);
  command.callback([options, &command, &status] {
    options->settings.find_drift = !options->no_drift;
    run(command, *options, status);
  });
}

}  // namespace birdseye::host
