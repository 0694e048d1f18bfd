#include "device/birdseyed/appliance.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "device/birdseyed/camera_thread.hpp"
#include "device/birdseyed/gpio_thread.hpp"
#include "device/birdseyed/safe_mode.hpp"
#include "device/birdseyed/tracker_thread.hpp"
#include "device/wire/clock_discipline.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/crash_note.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::device {

namespace {

constexpr Duration kTickWaiting = Duration::from_ms(5);  // while frames wait for poses
constexpr Duration kTickIdle = Duration::from_ms(100);
constexpr Duration kHealthEvery = Duration::from_ms(1000);
constexpr Duration kAliveWithin = Duration::from_ms(30'000);  // a tracker that is being reset takes its time

}  // namespace

Appliance::Appliance(const Config& config, wire::Server& server)
    : config_(config),
      server_(server),
      tracker_post_(Instrument::tracker, queue_),
      camera_post_(Instrument::camera, queue_),
      gpio_post_(Instrument::gpio, queue_),
      core_alive_ns_(device_now().ns) {}

Result<std::unique_ptr<Appliance>> Appliance::start(const Config& config, wire::Server& server,
                                                    const std::vector<std::string>& left_out) {
  std::unique_ptr<Appliance> appliance(new Appliance(config, server));
  Appliance* const a = appliance.get();
  const auto is_left_out = [&](const char* part) {
    return std::find(left_out.begin(), left_out.end(), part) != left_out.end();
  };
  if (!config.record.folder.empty() && is_left_out("recording")) {
    a->not_recording_ = why_left_out("recording");
    spdlog::error("{}", a->not_recording_);
  } else if (!config.record.folder.empty()) {
    a->start_recording();
  }
  const auto begin = [&](InstrumentPost& post, auto run) {
    const char* const name = name_of(post.instrument());
    if (is_left_out(name)) {
      post.tell({.state = InstrumentState::absent, .text = why_left_out(name)});
      return;
    }
    post.tell({.state = InstrumentState::starting, .text = fmt::format("the {} is being looked for", name)});
    a->begun_.push_back(&post);
    a->threads_.emplace_back([run, name](const std::stop_token& stop) {
      name_this_thread(name);
      run(stop);
    });
  };
  begin(a->tracker_post_, [a](const std::stop_token& s) { run_tracker(a->config_.tracker, a->tracker_post_, s); });
  const ControlsLock lock{
      [a] { return a->server_.camera_locked(); },
      [a](bool locked, const drivers::ControlReport& report) {
        a->server_.publish(wire::pack(wire::CameraControls{locked, report.done, report.refused}, device_now()));
      }};
  begin(a->camera_post_, [a, lock](const std::stop_token& s) {
    run_camera(a->config_.camera, a->config_.open_camera, a->camera_post_, lock, s);
  });
  if (!config.gpio.lines.chip.empty())
    begin(a->gpio_post_, [a](const std::stop_token& s) { run_gpio(a->config_.gpio, a->state_, a->gpio_post_, s); });
  a->threads_.emplace_back([a](const std::stop_token& s) { a->make_messages(s); });
  return appliance;
}

std::vector<QueueFill> Appliance::fills() const {
  std::vector<QueueFill> out = queue_.fills();
  if (recorder_) out.push_back(recorder_->fill());
  return out;
}

/// Without a recording the appliance still does its work.
void Appliance::start_recording() {
  auto started = Recorder::start(config_.record, config_.core);
  if (started) {
    recorder_ = *std::move(started);
    spdlog::info("recording to {}", recorder_->path().string());
  } else {
    not_recording_ = "not recording: " + started.error().what;
    spdlog::error("{}", not_recording_);
  }
}

Appliance::~Appliance() {
  for (OwnedThread& thread : threads_) thread.request_stop();
  for (OwnedThread& thread : threads_) thread.join();
}

void Appliance::make_messages(const std::stop_token& stop) {
  Core core(config_.core);
  std::string status = core.status_text();
  wire::Health health;
  std::optional<Core::Counters> before;
  DeviceTime measured;
  name_this_thread("messages");
  while (!stop.stop_requested()) {
    auto event = queue_.pop(device_now() + (core.waiting() ? kTickWaiting : kTickIdle), stop);
    if (!event) event = Tick{device_now()};
    at_work_on(origin_of(*event));
    if (recorder_) recorder_->take(*event);
    for (const wire::Packet& packet : core.take(*event)) server_.publish(packet);
    bool changed = std::holds_alternative<InstrumentChanged>(*event);
    if (core.status_text() != status) {
      status = core.status_text();
      changed = true;
      spdlog::info("status: {}", status.empty() ? "all is well" : status);
    }
    const DeviceTime now = device_now();
    const bool due = !before || now - measured >= kHealthEvery;
    if (due) {
      const Core::Counters counters = core.counters();
      health = figures(before.value_or(counters), counters, before ? (now - measured).seconds() : 1);
      before = counters;
      measured = now;
    }
    // A change is told before any frame of the instrument that it is of: what is drawn may depend on which one that is.
    if (due || changed) {
      tell_instruments(core.board(), health);
      server_.publish(wire::pack(health, now));
    }
    core_alive_ns_ = now.ns;
    state_ = core.board().state();
    const std::lock_guard lock(told_mutex_);
    board_ = core.board();
  }
}

namespace {

wire::WallClock read_wall_clock() {
  const auto read = wire::read_clock_discipline();
  const std::int64_t shift_ns = wall_minus_monotonic().ns;
  if (!read) {
    wire::WallClock unknown;
    unknown.wall_minus_monotonic_ns = shift_ns;
    return unknown;
  }
  return {true, read->synchronised, read->tai_known, read->max_error.ns, read->est_error.ns, shift_ns, read->source};
}

}  // namespace

wire::Health Appliance::figures(const Core::Counters& before, const Core::Counters& counters, double seconds) {
  const auto sent = server_.take_counters();
  const auto& tracker = counters.tracker;
  wire::Health health;
  health.tracker_rate_hz = static_cast<double>(tracker.measurements - before.tracker.measurements) / seconds;
  health.frame_rate_hz = static_cast<double>(counters.frames - before.frames) / seconds;
  health.measurements = tracker.measurements;
  health.measurements_lost = tracker.lost_measurements;
  health.phase_errors = tracker.phase_errors;
  health.senseless_records = tracker.senseless_records;
  for (std::size_t i = 1; i < tracker.doubted.size(); ++i) health.doubted += tracker.doubted[i];
  health.line_errors = tracker.line_errors;
  health.clock_events = counters.clock_events;
  health.frames = counters.frames;
  health.frames_dropped = counters.frames_lost;
  health.frames_repeated = counters.frames_repeated;
  health.spurious_strobe_edges = counters.spurious_strobe_edges;
  health.messages_shed = sent.messages_shed;
  health.clients = sent.clients;
  health.clients_shed = sent.clients_shed;
  health.events_dropped = queue_.frames_dropped() + queue_.others_dropped();
  health.requests_refused = sent.requests_refused;
  health.latency_ms_p99_tracker = sent.latency_ms_p99_tracker;
  health.latency_ms_p99_tracker_beside_frames = sent.latency_ms_p99_tracker_beside_frames;
  health.latency_ms_p99_frame = sent.latency_ms_p99_frame;
  health.tracker_drift_ppm = counters.tracker_drift_ppm;
  health.camera_drift_ppm = counters.camera_drift_ppm;
  health.tracker_time_sigma_ms = counters.tracker_time_sigma_ms;
  health.clock = read_wall_clock();
  health.reference = config_.tracker.reference;
  health.field_unsigned = config_.core.field_unsigned;
  return health;
}

void Appliance::tell_instruments(const InstrumentBoard& board, wire::Health& health) const {
  health.recording = recorder_ ? recorder_->text() : not_recording_;
  health.state = name_of(board.state());
  health.instruments.clear();
  for (const Instrument instrument : {Instrument::tracker, Instrument::camera, Instrument::gpio}) {
    const auto& entry = board.of(instrument);
    if (entry.state != InstrumentState::unused)
      health.instruments.push_back(
          {name_of(instrument), name_of(entry.state), entry.text, entry.times_lost, entry.identity});
  }
}

std::string Appliance::hanging() const {
  const DeviceTime least = device_now() - kAliveWithin;
  for (const InstrumentPost* const post : begun_) {
    if (post->last_alive() <= least) return name_of(post->instrument());
  }
  return DeviceTime{core_alive_ns_} > least ? "" : "messages";
}

std::string Appliance::summary() const {
  const std::lock_guard lock(told_mutex_);
  const std::string faults = board_.faults();
  return fmt::format("{}{}{}{}{}", name_of(board_.state()), faults.empty() ? "" : ": ", faults,
                     not_recording_.empty() ? "" : "; ", not_recording_);
}

}  // namespace birdseye::device
