#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

namespace birdseye::host {

/// The machine that a benchmark runs on: cores, instruction set, kernel.
nlohmann::json bench_machine();

}  // namespace birdseye::host
