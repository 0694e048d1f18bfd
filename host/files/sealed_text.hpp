#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// A part of a sealed text, by its name.
using SealedPart = std::pair<std::string, nlohmann::json>;

/// A JSON object of which not one bit may be changed: a line for each part, then "sha256" with the sum of each part's
/// line, then "whole" with the sum of all that stands before it. Whoever wants to change such a file has to write all
/// of it anew.
std::string sealed_text(const std::vector<SealedPart>& parts);

/// The object, without its sums. Refuses a text that is not, to the bit, as it was written, with the part that is
/// damaged: `its part "registered" was changed or damaged`, `is cut off in its part "deformed"`.
Result<nlohmann::json> unseal(const std::string& text);

}  // namespace birdseye::host
