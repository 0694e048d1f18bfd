#pragma once

#include <nlohmann/json_fwd.hpp>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// `birdseye bench similarity`: times each measure of how alike two pictures are, and OpenCV's, in so many rounds of 41
/// calls, of which the fastest counts. Gives the table (rows), the machine, and a verdict with its reason: whether
/// mutual information has OpenCV's value.
Result<nlohmann::json> similarity_study(int rounds);

}  // namespace birdseye::host
