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
  std::optional<std::uint8_t> parameter;  ///< that tells; absent where this firmware has none
  Bytes value;                            ///< of the parameter, once set
  bool as_after_reset = false;            ///< a unit that has been reset is so by itself
};

/// Everything but the rate, and group mode, in the order in which it is to be sent. What the firmware cannot do is left
/// out and told in notes.
std::vector<Setting> settings_of_unit(const MiniBirdSettings& settings, const UnitInfo& info, std::size_t index,
                                      std::vector<std::string>& notes);
/// What goes to the unit that has the port, after all others.
std::vector<Setting> settings_of_port(const MiniBirdSettings& settings, const UnitInfo& master);

/// Sends, and reads back what can be. was_reset: leave out what is so by itself. Errc::bad_value: the unit will not.
Result<void> apply(Dialogue& dialogue, const std::vector<Setting>& list, bool was_reset);
/// Has a unit that was not reset all this already? The first thing that it has not, or that it cannot be asked, by
/// name; empty if all is well.
Result<std::string> first_difference(Dialogue& dialogue, const std::vector<Setting>& list);

/// Sets the measurement rate by whichever parameter the firmware has, and returns what it then is. only_look: sets
/// nothing.
Result<double> settle_rate(Dialogue& dialogue, const MiniBirdSettings& settings, const UnitInfo& master,
                           bool only_look = false);
/// Reads the position scale.
Result<double> mm_per_count_of(Dialogue& dialogue, std::uint8_t unit);

/// How the stream of units so configured is to be read.
StreamLayout layout_of(const MiniBirdSettings& settings, const std::vector<UnitInfo>& units, double rate_hz);

}  // namespace birdseye::drivers::minibird
