#pragma once

#include <string>
#include <vector>

#include "tests/e2e/fault_judge.hpp"

namespace birdseye::testing {

std::vector<std::string> table_lines(const std::vector<FaultRow>& rows);
/// Without what was measured.
std::string unmeasured(const std::string& line);

}  // namespace birdseye::testing
