#include "hw-sim/local/local_camera.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"
#include "hw-sim/video/half_size.hpp"

namespace birdseye::hw_sim {

namespace {

using drivers::Frame;
using Pixels = std::shared_ptr<const std::vector<std::uint8_t>>;

constexpr std::size_t kRemembered = 1024;  // exposures: 40 s of 25 Hz
constexpr std::uint8_t kGrey = 90;

Pixels grey(int width_px, int height_px) {
  return std::make_shared<const std::vector<std::uint8_t>>(
      std::size_t{3} * static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px), kGrey);
}

}  // namespace

struct LocalCamera::State {
  State(const Settings& of, std::int64_t zero_ns)
      : settings(of),
        whole(grey(of.width_px, of.height_px)),
        half(grey(of.width_px / 2, of.height_px / 2)),
        script(of.timing, zero_ns) {
    script.watched(zero_ns);
  }

  void remember(const FramePlan& plan) {
    exposed.emplace_back(plan.sequence, plan.exposed_ns);
    if (exposed.size() > kRemembered) exposed.pop_front();
  }

  /// Only of frames that arrive is anything drawn.
  [[nodiscard]] Pixels picture(const FramePlan& plan) const {
    if (!settings.look) return plan.half_size ? half : whole;
    auto seen = settings.look(plan.exposed_ns);
    if (plan.half_size) seen = half_size_of(seen, settings.width_px, settings.height_px);
    return std::make_shared<const std::vector<std::uint8_t>>(std::move(seen));
  }

  const Settings settings;
  const Pixels whole, half;
  mutable std::mutex mutex;  // of what follows; never held over a wait
  CameraScript script;
  std::deque<std::pair<std::uint64_t, std::int64_t>> exposed;
  bool open = false;
};

namespace {

class LocalCameraEnd final : public drivers::FrameSource {
 public:
  explicit LocalCameraEnd(std::shared_ptr<LocalCamera::State> camera) : camera_(std::move(camera)) {}
  ~LocalCameraEnd() override {
    const std::lock_guard lock(camera_->mutex);
    camera_->open = false;
  }
  LocalCameraEnd(const LocalCameraEnd&) = delete;
  LocalCameraEnd& operator=(const LocalCameraEnd&) = delete;

  Result<std::optional<Frame>> next(Deadline deadline) override {
    for (;;) {
      const std::int64_t now_ns = device_now().ns;
      std::int64_t due_ns = 0;
      {
        const std::lock_guard lock(camera_->mutex);
        if (auto there = check_plug(now_ns); !there) return there.error();
        if (copies_ > 0) return again();
        if (!plan_) take_plan(now_ns);
        if (plan_->due_ns <= now_ns) {
          auto frame = arrived(*std::exchange(plan_, std::nullopt));
          if (!frame || *frame) return frame;
          continue;
        }
        due_ns = plan_->due_ns;
      }
      if (deadline.passed()) return std::optional<Frame>();
      sleep_until(std::min(deadline, Deadline(DeviceTime{due_ns})));
    }
  }
  [[nodiscard]] const std::string& name() const override { return camera_->settings.name; }
  [[nodiscard]] std::string describe() const override {
    return fmt::format("{}: within the process, {}x{}", name(), camera_->settings.width_px,
                       camera_->settings.height_px);
  }
  [[nodiscard]] std::map<std::string, std::string> identity() const override {
    return {{"model", "simulated"}, {"serial", camera_->settings.name}};
  }
  [[nodiscard]] drivers::FrameCounters counters() const override { return counters_; }
  [[nodiscard]] double rate_hz() const override { return camera_->settings.timing.rate_hz; }

 private:
  Result<void> check_plug(std::int64_t now_ns) {
    camera_->script.advance(now_ns);
    if (!camera_->script.plugged()) return Error{Errc::disconnected, name() + ": the camera has gone"};
    return {};
  }

  /// The next exposure; of those that nobody was there to take nothing is left.
  void take_plan(std::int64_t now_ns) {
    do {
      plan_ = camera_->script.next();
      camera_->remember(*plan_);
    } while (!began_ && plan_->due_ns < now_ns);
    began_ = true;
  }

  Result<std::optional<Frame>> arrived(const FramePlan& plan) {
    if (std::exchange(torn_, false) || plan.garbage_bytes > 0)
      return Error{Errc::bad_format, name() + ": what it sends is not a frame"};
    if (plan.lost) return std::optional<Frame>();
    torn_ = plan.part < 1;  // what follows begins where nobody expects it
    frame_.rgb = camera_->picture(plan);
    frame_.width_px = camera_->settings.width_px / (plan.half_size ? 2 : 1);
    frame_.height_px = camera_->settings.height_px / (plan.half_size ? 2 : 1);
    frame_.sequence = plan.sequence;
    frame_.acquired = DeviceTime{plan.stamp_ns};
    frame_.acquired_sigma = Duration{plan.sigma_ns};
    frame_.acquired_known = plan.stamp_ns != 0;
    copies_ = plan.copies;
    return again();
  }

  Result<std::optional<Frame>> again() {
    --copies_;
    ++counters_.frames;
    frame_.arrived = device_now();
    frame_.stamp_ahead = frame_.acquired_known ? std::max(frame_.acquired - frame_.arrived, Duration{}) : Duration{};
    return std::optional(frame_);
  }

  std::shared_ptr<LocalCamera::State> camera_;
  std::optional<FramePlan> plan_;
  Frame frame_;
  drivers::FrameCounters counters_;
  int copies_ = 0;  ///< of frame_ that are still to come
  bool began_ = false, torn_ = false;
};

}  // namespace

LocalCamera::LocalCamera(const Settings& settings, std::int64_t zero_ns)
    : state_(std::make_shared<State>(settings, zero_ns)) {}

Result<std::unique_ptr<drivers::FrameSource>> LocalCamera::open() const {
  const std::lock_guard lock(state_->mutex);
  state_->script.advance(device_now().ns);
  const std::string& name = state_->settings.name;
  if (!state_->script.plugged()) return Error{Errc::not_found, name + ": no camera listens there; plug it in"};
  if (state_->open) return Error{Errc::in_use, name + ": is in use"};
  state_->open = true;
  return std::unique_ptr<drivers::FrameSource>(std::make_unique<LocalCameraEnd>(state_));
}

std::optional<std::int64_t> LocalCamera::exposed_ns(std::uint64_t sequence) const {
  const std::lock_guard lock(state_->mutex);
  for (auto it = state_->exposed.rbegin(); it != state_->exposed.rend(); ++it) {
    if (it->first == sequence) return it->second;
  }
  return std::nullopt;
}

}  // namespace birdseye::hw_sim
