#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/e2e/fault_judge.hpp"

namespace birdseye::testing {

/// A table of the manual's page: the lines between "<!-- NAME -->" and the next empty line.
std::vector<std::string> table_lines(const std::vector<FaultRow>& rows);
std::vector<std::string> table_of_page(const std::filesystem::path& page, const std::string& name);
/// Puts a table in the place of the one that is there.
void replace_table(const std::filesystem::path& page, const std::string& name, const std::vector<std::string>& lines);
/// Without what was measured.
std::string unmeasured(const std::string& line);

}  // namespace birdseye::testing
