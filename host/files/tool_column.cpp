#include "host/files/tool_column.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "host/files/column_names.hpp"

namespace birdseye::host {

namespace {

/// No tracker follows more; a column with more names counts something.
constexpr std::size_t kMostTools = 64;

/// Whether the name of a column, its words joined, ends in a word for a tool, with or without what numbers one.
bool names_a_tool(std::string_view joined) {
  for (const std::string_view end : {"", "name", "id", "number", "no", "nr", "index", "serial", "label", "handle"}) {
    if (!joined.ends_with(end)) continue;
    const std::string_view noun = joined.substr(0, joined.size() - end.size());
    for (const std::string_view tool : {"tool", "port", "handle", "sensor", "body", "device", "bird", "transform",
                                        "marker", "subject", "instrument", "object", "childframe"}) {
      if (noun.ends_with(tool)) return true;
    }
  }
  return false;
}

bool names_anything(std::string_view joined) {
  return joined == "id" || joined == "name" || joined == "label" || joined == "serial" || joined.ends_with("frameid") ||
         joined == "serialnumber";
}

}  // namespace

std::string ToolColumn::names() const {
  std::vector<std::string> out;
  out.reserve(rows.size());
  for (const auto& [name, count] : rows) out.push_back(fmt::format("{} ({} rows)", name, count));
  return fmt::format("{}", fmt::join(out, ", "));
}

ToolColumnSearch::ToolColumnSearch(const std::vector<std::string>& header) {
  for (std::size_t i = 0; i < header.size(); ++i) {
    const ColumnName name = column_name(header[i]);
    if (pose_column(name)) continue;
    const std::string joined = fmt::format("{}", fmt::join(name.words, ""));
    const bool strong = names_a_tool(joined);
    if (strong || names_anything(joined)) candidates_.push_back({{i, header[i], {}}, !strong, false});
  }
}

void ToolColumnSearch::take(const std::vector<std::string>& row) {
  ++count_;
  for (Candidate& candidate : candidates_) {
    ToolColumn& column = candidate.column;
    if (candidate.too_many || column.at >= row.size() || row[column.at].empty()) continue;
    ++column.rows[row[column.at]];
    candidate.too_many = column.rows.size() > kMostTools;
  }
}

std::optional<ToolColumn> ToolColumnSearch::found() const {
  const Candidate* best = nullptr;
  for (const Candidate& candidate : candidates_) {
    const std::size_t names = candidate.column.rows.size();
    if (candidate.too_many || names == 0 || (candidate.weak && 2 * names > count_)) continue;
    const auto rank = [](const Candidate& c) { return std::pair(!c.weak, c.column.rows.size()); };
    if (best == nullptr || rank(candidate) > rank(*best)) best = &candidate;
  }
  if (best == nullptr) return std::nullopt;
  return best->column;
}

}  // namespace birdseye::host
