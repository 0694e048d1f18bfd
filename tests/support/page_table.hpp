#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace birdseye::testing {

/// A table of the manual's page: the lines between "<!-- NAME -->" and the next empty line.
std::vector<std::string> table_of_page(const std::filesystem::path& page, const std::string& name);
/// Puts a table in the place of the one that is there.
void replace_table(const std::filesystem::path& page, const std::string& name, const std::vector<std::string>& lines);

}  // namespace birdseye::testing
