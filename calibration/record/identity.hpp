#pragma once

#include <map>
#include <optional>
#include <string>

namespace birdseye::calibration {

/// What an instrument says it is, as "model", "sensor_serial" and so on. Empty: nothing is known of it.
using Identity = std::map<std::string, std::string>;

/// What of an instrument is not as it was recorded: the first that differs, or that is told no more (told: empty).
struct IdentityDifference {
  std::string name, recorded, told;
};
std::optional<IdentityDifference> first_difference(const Identity& recorded, const Identity& told);

/// Why a record made with one instrument is not to be used with another, in words; empty where all that the record
/// knows is as the instrument says. A record that knows nothing fits nothing, and what the instrument does not say
/// cannot fit. what: "tracker", "camera". of: what was made with it.
std::string misfit(const std::string& what, const Identity& recorded, const Identity& told,
                   const std::string& of = "the record");

}  // namespace birdseye::calibration
