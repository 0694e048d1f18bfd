#include "hw-sim/world/frame_camera.hpp"

#include <sys/resource.h>
#include <tbb/task_scheduler_observer.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/system/clock.hpp"
#include "hw-sim/faults/announce.hpp"
#include "hw-sim/video/half_size.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr std::size_t kQueueFrames = 160;
constexpr std::size_t kReadyFrames = 60;
constexpr std::int64_t kListenNs = 20'000'000;

/// Has those who trace a frame wait for whoever is to show it. The tracker's thread is not one of them.
class PatientTracers : public tbb::task_scheduler_observer {
 public:
  ~PatientTracers() override { observe(false); }
  void on_scheduler_entry(bool /*is_worker*/) override {
    (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNice);
  }

 private:
  static constexpr int kNice = 10;
};

}  // namespace

Result<std::unique_ptr<FrameCamera>> FrameCamera::listen(const Settings& settings, const World& world,
                                                         Laparoscope& laparoscope) {
  auto sink = listen_for_frames(settings.socket, settings.seed);
  if (!sink) return sink.error();
  return std::unique_ptr<FrameCamera>(new FrameCamera(settings, world, laparoscope, *std::move(sink)));
}

FrameCamera::FrameCamera(Settings settings, const World& world, Laparoscope& laparoscope,
                         std::unique_ptr<FrameSink> sink)
    : settings_(std::move(settings)),
      world_(world),
      laparoscope_(laparoscope),
      sink_(std::move(sink)),
      frames_(static_cast<std::uint64_t>(std::ceil(world.ends_s() * settings_.rate_hz))) {
  renderer_ = OwnedThread([this](const std::stop_token& stop) { render(stop); });
  server_ = OwnedThread([this](const std::stop_token& stop) { serve(stop); });
}

FrameCamera::~FrameCamera() {
  renderer_.request_stop();
  server_.request_stop();
  changed_.notify_all();
  renderer_.join();
  server_.join();
}

bool FrameCamera::ready() const {
  const std::lock_guard lock(mutex_);
  return connected_ && queue_.size() >= std::min<std::size_t>(kReadyFrames, frames_);
}

void FrameCamera::start(std::int64_t world_zero_ns) {
  zero_ns_ = world_zero_ns;
}

void FrameCamera::render(const std::stop_token& stop) {
  PatientTracers patient;
  if (settings_.drop_late) patient.observe(true);
  std::int64_t tracing_ns = 0;
  for (std::uint64_t sequence = 0; sequence < frames_; ++sequence) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, stop, [&] { return queue_.size() < kQueueFrames; });
    }
    if (stop.stop_requested()) return;
    if (settings_.drop_late && sequence + 1 < frames_ && too_late_for(sequence, tracing_ns)) continue;
    const std::int64_t began_ns = device_now().ns;
    const double world_s = static_cast<double>(sequence) / settings_.rate_hz;
    const Transform<Tracker, Camera> pose = world_.tracker_from_camera(world_s);
    laparoscope_.zoom(world_.zoom(world_s));
    laparoscope_.change_organ(world_.organ(world_s));
    Rendered rendered{
        sequence, world_.at_bench(world_s)
                      ? laparoscope_.look_at_bench(pose.inverse() * world_.tracker_from_marker(world_s), sequence)
                      : laparoscope_.look_into_cavity(pose.inverse() * world_.tracker_from_patient(world_s), sequence)};
    tracing_ns = device_now().ns - began_ns;
    {
      const std::lock_guard lock(mutex_);
      queue_.push_back(std::move(rendered));
    }
    changed_.notify_all();
  }
}

bool FrameCamera::too_late_for(std::uint64_t sequence, std::int64_t tracing_ns) const {
  const auto after_zero_ns = static_cast<std::int64_t>(1e9 * static_cast<double>(sequence) / settings_.rate_hz);
  return zero_ns_ != 0 && device_now().ns + tracing_ns > zero_ns_ + after_zero_ns;
}

bool FrameCamera::take(Rendered& rendered, const std::stop_token& stop) {
  {
    std::unique_lock lock(mutex_);
    if (!changed_.wait(lock, stop, [&] { return !queue_.empty(); })) return false;
    rendered = std::move(queue_.front());
    queue_.pop_front();
  }
  changed_.notify_all();
  return true;
}

FramePixels FrameCamera::picture_of(const Rendered& rendered, bool half_size) {
  const int width = settings_.lens.width_px, height = settings_.lens.height_px;
  if (!half_size) return {rendered.rgb, FrameFormat::rgb3, width, height};
  half_ = half_size_of(rendered.rgb, width, height);
  return {half_, FrameFormat::rgb3, width / 2, height / 2};
}

/// Faults of the plug up to now, then bytes out and readers in, until the time at the latest.
void FrameCamera::follow(CameraScript& script, std::int64_t until_ns) {
  const std::int64_t now_ns = device_now().ns;
  script.advance(now_ns);
  if (script.plugged() != plugged_) {
    if (plugged_) sink_->unplug();
    plugged_ = script.plugged() && sink_->replug().has_value();
  }
  for (const FaultEvent& event : script.take_events()) announce(event);
  sink_->work(std::min(until_ns, now_ns + kListenNs));
}

void FrameCamera::serve_world(CameraScript& script, const std::stop_token& stop) {
  Rendered rendered;
  while (!stop.stop_requested() && sent_ < frames_) {
    FramePlan plan = script.next();
    // A frame goes out whole, however slow its reader: the world is short, and none of it may be missed.
    while (sink_->busy() && !stop.stop_requested()) follow(script, device_now().ns + kListenNs);
    if (!take(rendered, stop)) return;
    for (; sent_ < rendered.number; ++sent_) plan = script.next();
    do {
      follow(script, plan.due_ns);
    } while (!stop.stop_requested() && device_now().ns < plan.due_ns);
    if (!plan.lost && !sink_->busy()) sink_->begin(plan, picture_of(rendered, plan.half_size));
    ++sent_;
  }
  while (sink_->busy() && !stop.stop_requested()) follow(script, device_now().ns + kListenNs);
}

void FrameCamera::serve(const std::stop_token& stop) {
  while (!stop.stop_requested() && !sink_->connected()) sink_->work(device_now().ns + kListenNs);
  connected_ = sink_->connected();
  // Until the world begins no frame comes, and a reader may lose its patience and come again.
  while (!stop.stop_requested() && zero_ns_ == 0) sink_->work(device_now().ns + 5'000'000);
  CameraTiming timing;
  timing.rate_hz = settings_.rate_hz;
  timing.seed = settings_.seed;
  if (settings_.delay_ms > 0) {
    timing.stamps = false;
    timing.delivery_ms = settings_.delay_ms;
  }
  timing.faults = settings_.faults;
  CameraScript script(timing, zero_ns_);
  script.watched(zero_ns_);
  serve_world(script, stop);
  sink_.reset();
  done_ = true;
}

}  // namespace birdseye::hw_sim
