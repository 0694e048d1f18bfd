#pragma once

#include <nlohmann/json_fwd.hpp>

#include "device/birdseyed/core.hpp"

/// What an appliance recording keeps as JSON: how a tracker's bytes are to be read, and the core's settings.
namespace birdseye::drivers::minibird {

void to_json(nlohmann::json& json, const StreamLayout& layout);
void from_json(const nlohmann::json& json, StreamLayout& layout);

}  // namespace birdseye::drivers::minibird

namespace birdseye::device {

void to_json(nlohmann::json& json, const CoreSettings& settings);
/// Throws where the field map makes no sense: going on without it would publish other poses.
void from_json(const nlohmann::json& json, CoreSettings& settings);

}  // namespace birdseye::device
