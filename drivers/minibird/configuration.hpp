#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/minibird/dialogue.hpp"
#include "drivers/minibird/settings.hpp"
#include "drivers/minibird/unit_info.hpp"

namespace birdseye::drivers::minibird {

/// One thing to set at one unit, and how to see that it is.
struct Setting {
  std::string name;                       ///< for messages, as "hemisphere of bird 2"
  std::uint8_t unit = 0;                  ///< 0: the one that has the port
  Bytes command;                          ///< empty: not to be set, only looked at
  std::optional<std::uint8_t> parameter;  ///< that reads it back; absent where this firmware has none
  Bytes value;                            ///< of the parameter, once set
  bool as_after_reset = false;            ///< a reset alone sets it so
};

/// All settings of a unit except rate and group mode, in the order in which they are to be sent. What the firmware
/// cannot do is left out and told in notes.
std::vector<Setting> settings_of_unit(const MiniBirdSettings& settings, const UnitInfo& info, std::size_t index,
                                      std::vector<std::string>& notes);
/// What goes to the unit that has the port, after all others.
std::vector<Setting> settings_of_port(const MiniBirdSettings& settings, const UnitInfo& master);

/// Sends the settings, and reads back those that can be read. was_reset: leaves out what the reset has set.
/// Errc::bad_value: the unit does not take a setting.
Result<void> apply(Dialogue& dialogue, const std::vector<Setting>& list, bool was_reset);
/// Whether a unit that was not reset has all these settings already: the name of the first that it has not, or cannot
/// be asked for; empty if it has all.
Result<std::string> first_difference(Dialogue& dialogue, const std::vector<Setting>& list);

/// Sets the measurement rate by the parameter that the firmware has, and returns the rate that the unit then has.
/// only_look: sets nothing.
Result<double> settle_rate(Dialogue& dialogue, const MiniBirdSettings& settings, const UnitInfo& master,
                           bool only_look = false);
/// Reads the position scale.
Result<double> mm_per_count_of(Dialogue& dialogue, std::uint8_t unit);

/// How the stream of units so configured is to be read.
StreamLayout layout_of(const MiniBirdSettings& settings, const std::vector<UnitInfo>& units, double rate_hz);

}  // namespace birdseye::drivers::minibird
