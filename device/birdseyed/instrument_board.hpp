#pragma once

#include <array>
#include <string>

#include "device/birdseyed/raw_event.hpp"

namespace birdseye::device {

/// How the appliance as a whole is.
enum class ApplianceState : std::uint8_t {
  starting,  ///< an instrument has yet to run for the first time
  ready,     ///< all that is configured runs
  degraded,  ///< something that has run does not
};
const char* name_of(ApplianceState state);

/// How each instrument is, and what that makes of the whole.
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
  [[nodiscard]] const Entry& of(Instrument instrument) const { return entries_[static_cast<std::size_t>(instrument)]; }
  [[nodiscard]] ApplianceState state() const;
  /// What is wrong, in words; empty when nothing is.
  [[nodiscard]] std::string faults() const;

 private:
  std::array<Entry, kInstruments> entries_;
};

/// The status LED: steady when ready, slow when starting, fast when degraded; dark means that nobody is there.
bool led_on(ApplianceState state, DeviceTime now);

}  // namespace birdseye::device
