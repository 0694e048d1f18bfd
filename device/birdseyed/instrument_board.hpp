#pragma once

#include <array>
#include <string>

#include "device/birdseyed/raw_event.hpp"

namespace birdseye::device {

/// How the appliance as a whole is.
enum class ApplianceState : std::uint8_t {
  starting,  ///< an instrument has yet to run for the first time
  ready,     ///< all that is configured runs
  degraded,  ///< an instrument that has run does not run now, or its times are not to be believed
};
const char* name_of(ApplianceState state);

/// The state of each instrument, and the state of the appliance that follows from them.
class InstrumentBoard {
 public:
  struct Entry {
    InstrumentState state = InstrumentState::unused;
    std::string text;
    std::map<std::string, std::string> identity;
    bool has_run = false;
    std::uint64_t times_lost = 0;
  };

  void note(const InstrumentChanged& changed);
  /// What is wrong with the times of an instrument that runs, in words; empty: nothing is.
  void set_clock_fault(const std::string& fault) { clock_fault_ = fault; }
  [[nodiscard]] const Entry& of(Instrument instrument) const { return entries_[static_cast<std::size_t>(instrument)]; }
  [[nodiscard]] ApplianceState state() const;
  /// What is wrong, in words; empty when nothing is.
  [[nodiscard]] std::string faults() const;

 private:
  std::array<Entry, kInstruments> entries_;
  std::string clock_fault_;
};

/// Whether the status LED is lit now: steadily when ready, blinking slowly when starting and fast when degraded. Dark
/// means that birdseyed does not run.
bool led_on(ApplianceState state, DeviceTime now);

}  // namespace birdseye::device
