#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "calibration/base/result.hpp"
#include "hw-sim/faults/fault.hpp"

namespace birdseye::hw_sim {

/// Writes one JSON line to standard output, at once.
void announce(const nlohmann::json& event);
void announce(const FaultEvent& event);
/// Replaces the file as a whole, so that a reader never sees half of it. A pipe or a device is written to as it is; a
/// folder is refused.
Result<void> replace_json(const std::filesystem::path& path, const nlohmann::json& json);

}  // namespace birdseye::hw_sim
