#include "device/birdseyed/appliance.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "drivers/io/monotonic.hpp"
#include "drivers/io/serial_port.hpp"
#include "drivers/minibird/assembler.hpp"

namespace birdseye::device {

namespace {

using drivers::now;

constexpr Duration kTick = Duration::from_ms(200);        // how soon a loop sees that it shall stop
constexpr Duration kLookAgain = Duration::from_ms(1000);  // for an instrument that has gone
constexpr Duration kSilent = Duration::from_ms(1000);     // of an instrument that is there
// A laparoscope moves a millimetre in that: a pose whose time is known no better is not passed on.
constexpr Duration kMostTimeSigma = Duration::from_ms(10);
constexpr std::size_t kFramesWaiting = 32;

void wait(Duration span, const std::stop_token& stop) {
  for (const DeviceTime until = now() + span; now() < until && !stop.stop_requested();)
    drivers::sleep_for(Duration::from_ms(20));
}

}  // namespace

Appliance::Appliance(Config config, std::unique_ptr<wire::Server> server)
    : config_(std::move(config)), server_(std::move(server)), scope_poses_(config_.pose), frames_(kFramesWaiting) {}

Result<std::unique_ptr<drivers::minibird::MiniBird>> Appliance::open_tracker(const Config& config,
                                                                             const std::stop_token& stop) {
  auto port = drivers::SerialPort::open(config.tracker_device, config.tracker.baud);
  if (!port) return port.error();
  return drivers::minibird::MiniBird::start(*std::move(port), config.tracker, stop);
}

Result<std::unique_ptr<Appliance>> Appliance::start(const Config& config, const std::stop_token& stop) {
  auto server = wire::Server::listen(config.bind, config.port);
  if (!server) return server.error();
  auto camera = drivers::open_camera(config.camera);
  if (!camera) return camera.error();
  auto tracker = open_tracker(config, stop);
  if (!tracker) return tracker.error();
  const auto& info = (*tracker)->info();
  spdlog::info("tracker {}: \"{}\" {}.{}, {} bird(s), {:.2f} Hz{}", config.tracker_device.string(), info.model,
               info.revision_major, info.revision_minor, config.tracker.birds, info.rate_hz,
               info.has_reset_line ? "" : ", no reset line");
  if (!info.latched_error.empty()) spdlog::warn("tracker: it had latched: {}", info.latched_error);

  std::unique_ptr<Appliance> appliance(new Appliance(config, *std::move(server)));
  Appliance* const a = appliance.get();
  a->tracker_thread_ = std::jthread(
      [a, t = *std::move(tracker)](const std::stop_token& s) mutable { a->tracker_loop(s, std::move(t)); });
  a->video_thread_ =
      std::jthread([a, c = *std::move(camera)](const std::stop_token& s) mutable { a->video_loop(s, std::move(c)); });
  a->pairing_thread_ = std::jthread([a](const std::stop_token& s) { a->pairing_loop(s); });
  a->health_thread_ = std::jthread([a](const std::stop_token& s) { a->health_loop(s); });
  spdlog::info("publishing on {} port {}", config.bind, appliance->port());
  return appliance;
}

Appliance::~Appliance() {
  for (std::jthread* thread : {&tracker_thread_, &video_thread_, &pairing_thread_, &health_thread_})
    thread->request_stop();
  for (std::jthread* thread : {&tracker_thread_, &video_thread_, &pairing_thread_, &health_thread_}) {
    if (thread->joinable()) thread->join();
  }
}

void Appliance::tell(const char* instrument, bool ok, const std::string& text) {
  spdlog::log(ok ? spdlog::level::info : spdlog::level::warn, "{}", text);
  {
    const std::lock_guard lock(faults_mutex_);
    faults_.erase(instrument);
    if (!ok) faults_[instrument] = text;
  }
  server_->publish(wire::pack(status(), now()));
}

wire::Status Appliance::status() const {
  const std::lock_guard lock(faults_mutex_);
  wire::Status status;
  status.ok = faults_.empty();
  for (const auto& [instrument, text] : faults_) status.text += (status.text.empty() ? "" : "; ") + text;
  return status;
}

void Appliance::tracker_loop(const std::stop_token& stop, std::unique_ptr<drivers::minibird::MiniBird> tracker) {
  DeviceTime heard = now();
  drivers::minibird::MeasurementAssembler assembler(tracker->layout());
  drivers::minibird::MiniBirdCounters before;  // of the times before the tracker was last lost
  while (!stop.stop_requested()) {
    auto read = tracker->read(now() + kTick);
    if (read && *read) heard = now();
    if (read && now() - heard > kSilent) {
      read = Error{Errc::timeout, fmt::format("{}: the tracker has fallen silent; check its power and cable",
                                              config_.tracker_device.string())};
    }
    if (read) {
      if (*read) {
        for (const auto& measurement : assembler.push(**read)) publish(measurement);
      }
      const auto counters = assembler.counters();
      phase_errors_ = before.phase_errors + counters.phase_errors;
      senseless_records_ = before.senseless_records + counters.senseless_records;
      continue;
    }
    tell("tracker", false, read.error().what);
    before.phase_errors = phase_errors_;
    before.senseless_records = senseless_records_;
    tracker.reset();
    while (!stop.stop_requested() && !tracker) {
      wait(kLookAgain, stop);
      if (auto again = open_tracker(config_, stop)) {
        tracker = *std::move(again);
        assembler = drivers::minibird::MeasurementAssembler(tracker->layout());
        tell("tracker", true, "the tracker is back");
        heard = now();
      }
    }
  }
}

void Appliance::publish(const drivers::minibird::Measurement& measurement) {
  ++measurements_;
  if (measurement.acquired_sigma > kMostTimeSigma) return;
  wire::Birds birds;
  birds.acquired = measurement.acquired;
  for (std::size_t i = 0; i < measurement.birds.size(); ++i) {
    const auto& bird = measurement.birds[i].pose;
    if (!bird || !bird->position_mm || !bird->rotation) continue;
    const Transform<Tracker, Sensor> pose(*bird->rotation, *bird->position_mm);
    if (i == 0) scope_poses_.push(measurement.acquired, pose);
    birds.birds.push_back({config_.bird_names[i], pose});
  }
  server_->publish(wire::pack(birds));
}

void Appliance::video_loop(const std::stop_token& stop, std::unique_ptr<drivers::FrameSource> camera) {
  std::uint64_t next_sequence = 0;  // 0: no frame yet, or none since the camera came back
  DeviceTime heard = now();
  bool silent = false;
  while (!stop.stop_requested()) {
    auto frame = camera->next(now() + kTick);
    if (frame) {
      if (!*frame) {
        // Said, not mended: a camera may pause, and one that is still there need not be opened again.
        if (!silent && now() - heard > kSilent) {
          silent = true;
          tell("camera", false, fmt::format("{}: the camera sends no frames", camera->name()));
        }
        continue;
      }
      heard = now();
      if (std::exchange(silent, false)) tell("camera", true, "the camera sends frames again");
      const std::uint64_t sequence = (*frame)->sequence;
      if (next_sequence != 0 && sequence > next_sequence) frames_lost_by_camera_ += sequence - next_sequence;
      next_sequence = sequence + 1;
      ++frames_seen_;
      frames_.push(**std::move(frame));
      continue;
    }
    tell("camera", false, frame.error().what);
    camera.reset();
    next_sequence = 0;
    while (!stop.stop_requested() && !camera) {
      wait(kLookAgain, stop);
      if (auto again = drivers::open_camera(config_.camera)) {
        camera = *std::move(again);
        tell("camera", true, "the camera is back");
        heard = now();
      }
    }
  }
}

void Appliance::pairing_loop(const std::stop_token& stop) {
  // The tracker's own delay, a cycle, its line and its smoothing: by then the poses about a frame have come, or will
  // not.
  const Duration patience = config_.pose.smoothing + config_.tracker.delay + Duration::from_ms(40);
  while (auto frame = frames_.pop(stop)) {
    wire::VideoFrame out;
    out.info.sequence = frame->sequence;
    out.info.acquired = frame->acquired;
    out.info.acquired_sigma = frame->acquired_sigma;
    out.info.arrived = frame->arrived;
    out.info.pose = scope_poses_.at(frame->acquired, frame->arrived + patience, stop);
    out.info.frames_dropped = frames_lost_by_camera_ + frames_.dropped();
    out.width_px = frame->width_px;
    out.height_px = frame->height_px;
    out.rgb = frame->rgb;
    server_->publish(wire::pack(out));
  }
}

void Appliance::health_loop(const std::stop_token& stop) {
  std::uint64_t before = measurements_;
  DeviceTime began = now();
  while (!stop.stop_requested()) {
    wait(Duration::from_ms(1000), stop);
    const DeviceTime ended = now();
    const std::uint64_t count = measurements_;
    wire::Health health;
    health.tracker_rate_hz = static_cast<double>(count - before) / (ended - began).seconds();
    health.measurements = count;
    health.phase_errors = phase_errors_;
    health.senseless_records = senseless_records_;
    health.frames = frames_seen_;
    health.frames_dropped = frames_lost_by_camera_ + frames_.dropped();
    health.messages_shed = server_->messages_shed();
    before = count;
    began = ended;
    server_->publish(wire::pack(health, ended));
    server_->publish(wire::pack(status(), ended));
  }
}

}  // namespace birdseye::device
