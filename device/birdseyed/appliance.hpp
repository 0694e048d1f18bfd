#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <thread>

#include "device/birdseyed/config.hpp"
#include "device/birdseyed/instrument_thread.hpp"
#include "device/birdseyed/recorder.hpp"
#include "device/wire/server.hpp"
#include "drivers/minibird/measurement.hpp"

namespace birdseye::device {

/// The appliance at work: a thread for each instrument hands over what comes, one makes messages of it and publishes
/// them, one reports health each second. An instrument that is not there, goes away or falls silent is said so on the
/// wire and looked for until it is back; the others go on.
class Appliance {
 public:
  /// server: outlives the appliance, so that clients stay connected when the configuration is read again.
  static Result<std::unique_ptr<Appliance>> start(const Config& config, wire::Server& server);
  ~Appliance();
  Appliance(const Appliance&) = delete;
  Appliance& operator=(const Appliance&) = delete;

  /// Every thread has shown itself lately.
  [[nodiscard]] bool alive() const;
  /// For the service manager: the state and what is wrong.
  [[nodiscard]] std::string summary() const;

 private:
  Appliance(const Config& config, wire::Server& server);
  void start_recording();
  void make_messages(const std::stop_token& stop);
  void report_health(const std::stop_token& stop);
  [[nodiscard]] wire::Health health(const Core::Counters& before, const Core::Counters& now, double seconds);

  Config config_;
  wire::Server& server_;
  std::unique_ptr<Recorder> recorder_;  ///< null where nothing is recorded
  std::string not_recording_;           ///< why there is none, where there should be
  EventQueue queue_;
  InstrumentPost tracker_post_, camera_post_, gpio_post_;
  std::atomic<std::int64_t> core_alive_ns_;
  std::atomic<ApplianceState> state_ = ApplianceState::starting;
  mutable std::mutex told_mutex_;  ///< of what the core's thread tells the one that reports
  Core::Counters counters_;
  InstrumentBoard board_;
  std::vector<std::jthread> threads_;
};

}  // namespace birdseye::device
