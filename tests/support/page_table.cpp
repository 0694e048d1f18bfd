#include "tests/support/page_table.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
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

void settle_table(const std::string& page, const std::string& variable, const std::string& command,
                  const std::string& name, const std::vector<std::string>& lines,
                  const std::function<std::string(const std::string&)>& unmeasured) {
  for (const std::string& line : lines) std::printf("%s\n", line.c_str());
  if (const char* written = std::getenv(variable.c_str())) return replace_table(written, name, lines);
  const char* source = std::getenv("BIRDSEYE_SOURCE_DIR");
  const auto file = std::filesystem::path(source != nullptr ? source : ".") / "docs/manual" / page;
  std::vector<std::string> here, there;
  for (const std::string& line : lines) here.push_back(unmeasured(line));
  for (const std::string& line : table_of_page(file, name)) there.push_back(unmeasured(line));
  EXPECT_EQ(here, there) << file << " is stale: " << command;
}

}  // namespace birdseye::testing
