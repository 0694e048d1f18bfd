#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "device/birdseyed/bounded_queue.hpp"
#include "device/birdseyed/config.hpp"
#include "device/birdseyed/scope_poses.hpp"
#include "device/wire/server.hpp"
#include "drivers/minibird/measurement.hpp"

namespace birdseye::device {

/// The appliance at work: one thread reads the tracker, one the camera, one pairs each frame with the scope's pose at
/// its acquisition time and publishes, one reports health. An instrument that goes away or falls silent is said so
/// on the wire, at once and every second, and looked for again until it is back.
class Appliance {
 public:
  /// Opens everything once: an instrument that is not there at the start, or a port in use, is an error.
  static Result<std::unique_ptr<Appliance>> start(const Config& config, const std::stop_token& stop);
  ~Appliance();
  Appliance(const Appliance&) = delete;
  Appliance& operator=(const Appliance&) = delete;

  [[nodiscard]] int port() const { return server_->port(); }

 private:
  Appliance(Config config, std::unique_ptr<wire::Server> server);
  static Result<std::unique_ptr<drivers::minibird::MiniBird>> open_tracker(const Config& config,
                                                                           const std::stop_token& stop);
  void tracker_loop(const std::stop_token& stop, std::unique_ptr<drivers::minibird::MiniBird> tracker);
  void publish(const drivers::minibird::Measurement& measurement);
  void video_loop(const std::stop_token& stop, std::unique_ptr<drivers::FrameSource> camera);
  void pairing_loop(const std::stop_token& stop);
  void health_loop(const std::stop_token& stop);
  void tell(const char* instrument, bool ok, const std::string& text);
  [[nodiscard]] wire::Status status() const;

  Config config_;
  std::unique_ptr<wire::Server> server_;
  ScopePoses scope_poses_;
  BoundedQueue<drivers::Frame> frames_;
  std::atomic<std::uint64_t> measurements_ = 0, phase_errors_ = 0, senseless_records_ = 0;
  std::atomic<std::uint64_t> frames_seen_ = 0, frames_lost_by_camera_ = 0;
  mutable std::mutex faults_mutex_;
  std::map<std::string, std::string> faults_;  ///< by instrument, while it has one
  std::jthread tracker_thread_, video_thread_, pairing_thread_, health_thread_;
};

}  // namespace birdseye::device
