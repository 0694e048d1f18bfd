#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

namespace birdseye::host {

/// Of what ran: cores, instruction set, kernel.
nlohmann::json bench_machine();

}  // namespace birdseye::host
