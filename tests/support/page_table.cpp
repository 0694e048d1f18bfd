#include "tests/support/page_table.hpp"

#include <fstream>

namespace birdseye::testing {

namespace {

std::vector<std::string> lines_of(const std::filesystem::path& path) {
  std::vector<std::string> lines;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

}  // namespace

std::vector<std::string> table_of_page(const std::filesystem::path& page, const std::string& name) {
  std::vector<std::string> table;
  bool within = false;
  for (const std::string& line : lines_of(page)) {
    if (within && line.empty()) break;
    if (within) table.push_back(line);
    if (line == "<!-- " + name + " -->") within = true;
  }
  return table;
}

void replace_table(const std::filesystem::path& page, const std::string& name, const std::vector<std::string>& lines) {
  const auto old = lines_of(page);
  std::ofstream out(page);
  bool within = false;
  for (const std::string& line : old) {
    if (within && !line.empty()) continue;
    within = line == "<!-- " + name + " -->";
    out << line << '\n';
    if (!within) continue;
    for (const std::string& fresh : lines) out << fresh << '\n';
  }
}

}  // namespace birdseye::testing
