#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace birdseye::testing {

/// A table of the manual's page: the lines between "<!-- NAME -->" and the next empty line.
std::vector<std::string> table_of_page(const std::filesystem::path& page, const std::string& name);
/// Puts a table in the place of the one that is there.
void replace_table(const std::filesystem::path& page, const std::string& name, const std::vector<std::string>& lines);
/// Writes a table into the page that the environment's variable names; without that variable the table has to be the
/// one of docs/manual/page, but for what unmeasured() takes from each line. command: writes the page anew.
void settle_table(const std::string& page, const std::string& variable, const std::string& command,
                  const std::string& name, const std::vector<std::string>& lines,
                  const std::function<std::string(const std::string&)>& unmeasured);

}  // namespace birdseye::testing
