#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <vector>

#include "calibration/base/queue_fill.hpp"
#include "device/birdseyed/config.hpp"
#include "device/birdseyed/instrument_thread.hpp"
#include "device/birdseyed/recorder.hpp"
#include "device/wire/server.hpp"
#include "drivers/minibird/measurement.hpp"
#include "drivers/system/thread.hpp"

namespace birdseye::device {

/// The appliance at work: a thread for each instrument hands over what comes, one thread makes messages of it and
/// publishes them, and Health each second and with each change of an instrument. When an instrument is not there, goes
/// away or falls silent, the appliance says so on the wire and looks for it until it is back; the others go on.
class Appliance {
 public:
  /// server: outlives the appliance, so that clients stay connected when the configuration is read again. left_out:
  /// instruments, and "recording", that are not begun; it says so in their place.
  static Result<std::unique_ptr<Appliance>> start(const Config& config, wire::Server& server,
                                                  const std::vector<std::string>& left_out = {});
  ~Appliance();
  Appliance(const Appliance&) = delete;
  Appliance& operator=(const Appliance&) = delete;

  /// The thread that has shown no sign of life lately, by its instrument; empty: all have.
  [[nodiscard]] std::string hanging() const;
  /// The state and what is wrong, for the service manager.
  [[nodiscard]] std::string summary() const;
  /// Of its queues, but for the server's.
  [[nodiscard]] std::vector<QueueFill> fills() const;

 private:
  Appliance(const Config& config, wire::Server& server);
  void start_recording();
  void make_messages(const std::stop_token& stop);
  /// All of a Health but what the instruments are and how they are.
  [[nodiscard]] wire::Health figures(const Core::Counters& before, const Core::Counters& now, double seconds);
  void tell_instruments(const InstrumentBoard& board, wire::Health& health) const;

  Config config_;
  wire::Server& server_;
  std::unique_ptr<Recorder> recorder_;  ///< null where nothing is recorded
  std::string not_recording_;           ///< why nothing is recorded, where something should be
  EventQueue queue_;
  InstrumentPost tracker_post_, camera_post_, gpio_post_;
  std::vector<const InstrumentPost*> begun_;  ///< those that have a thread
  std::atomic<std::int64_t> core_alive_ns_;
  std::atomic<ApplianceState> state_ = ApplianceState::starting;
  mutable std::mutex told_mutex_;  ///< of what follows
  InstrumentBoard board_;          ///< as the messages last told it
  std::vector<OwnedThread> threads_;
};

}  // namespace birdseye::device
