#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <vector>

#include "calibration/base/result.hpp"
#include "drivers/system/condition.hpp"
#include "drivers/system/thread.hpp"
#include "hw-sim/camera/laparoscope.hpp"
#include "hw-sim/video/frame_sink.hpp"
#include "hw-sim/world/world.hpp"

namespace birdseye::hw_sim {

/// A camera that delivers the frames of a world over a Unix socket at their times. Frames depend on the seed and their
/// number alone, so they are rendered ahead, into a queue of bounded length, by a thread of their own.
class FrameCamera {
 public:
  struct Settings {
    std::filesystem::path socket;
    CameraModel lens;
    double rate_hz = 25;
    std::uint64_t seed = 1;
    double delay_ms = 0;  ///< from exposure to arrival; frames then bear no stamp. 0: frames are stamped
    /// True: frames that cannot be traced before their exposure are left out, and whoever shows the frames has the
    /// processor first. False: such frames come late.
    bool drop_late = false;
    std::vector<Fault> faults;  ///< from the world's time 0 on
  };

  /// Listens at once. The world and the laparoscope must outlive the camera.
  static Result<std::unique_ptr<FrameCamera>> listen(const Settings& settings, const World& world,
                                                     Laparoscope& laparoscope);
  ~FrameCamera();
  FrameCamera(const FrameCamera&) = delete;
  FrameCamera& operator=(const FrameCamera&) = delete;

  /// Whether somebody is connected and enough frames are ready.
  [[nodiscard]] bool ready() const;
  /// Sets the world's time 0 on CLOCK_MONOTONIC; frames start to flow.
  void start(std::int64_t world_zero_ns);
  /// Whether all frames of the world have had their time.
  [[nodiscard]] bool done() const { return done_; }
  [[nodiscard]] std::uint64_t sent() const { return sent_; }

 private:
  struct Rendered {
    std::uint64_t number;
    std::vector<std::uint8_t> rgb;
  };
  FrameCamera(Settings settings, const World& world, Laparoscope& laparoscope, std::unique_ptr<FrameSink> sink);
  void render(const std::stop_token& stop);
  void serve(const std::stop_token& stop);
  void serve_world(CameraScript& script, const std::stop_token& stop);
  void follow(CameraScript& script, std::int64_t until_ns);
  /// Whether a frame is exposed before it could be traced. tracing_ns: how long tracing takes.
  [[nodiscard]] bool too_late_for(std::uint64_t sequence, std::int64_t tracing_ns) const;
  [[nodiscard]] bool take(Rendered& rendered, const std::stop_token& stop);
  [[nodiscard]] FramePixels picture_of(const Rendered& rendered, bool half_size);

  Settings settings_;
  const World& world_;
  Laparoscope& laparoscope_;
  std::unique_ptr<FrameSink> sink_;  ///< the server's own once it runs
  bool plugged_ = true;
  std::vector<std::uint8_t> half_;
  std::uint64_t frames_;
  mutable std::mutex mutex_;
  Condition changed_;
  std::deque<Rendered> queue_;
  std::atomic<bool> connected_ = false, done_ = false;
  std::atomic<std::int64_t> zero_ns_ = 0;
  std::atomic<std::uint64_t> sent_ = 0;
  OwnedThread renderer_, server_;
};

}  // namespace birdseye::hw_sim
