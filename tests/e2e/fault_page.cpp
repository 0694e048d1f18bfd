#include "tests/e2e/fault_page.hpp"

#include <fmt/format.h>

#include <optional>

namespace birdseye::testing {

namespace {

constexpr int kSteadyColumns = 3;

std::string cell(const std::optional<double>& value, const char* unit, int digits) {
  return value ? fmt::format("{:.{}f}{}", *value, digits, unit) : std::string("-");
}

}  // namespace

std::vector<std::string> table_lines(const std::vector<FaultRow>& rows) {
  std::vector<std::string> lines{"| fault | how injected | what is seen | worst pose | time to recover | the rest |",
                                 "|---|---|---|---|---|---|"};
  for (const FaultRow& row : rows) {
    lines.push_back(fmt::format(
        "| {} | {} | {} | {} | {} | {} |", row.fault, row.how, row.seen,
        row.worst_mm ? fmt::format("{:.1f} of {:.1f} mm", *row.worst_mm, *row.promised_mm) : std::string("-"),
        cell(row.recovery_s, " s", 2), cell(row.others_percent, " %", 0)));
  }
  return lines;
}

std::string unmeasured(const std::string& line) {
  std::size_t cut = 0;
  for (int column = 0; column < kSteadyColumns && cut != std::string::npos; ++column) cut = line.find(" | ", cut + 1);
  return cut == std::string::npos ? line : line.substr(0, cut);
}

}  // namespace birdseye::testing
