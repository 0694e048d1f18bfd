#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace birdseye::host {

/// The column of a table that says whose pose each row holds, and who these are.
struct ToolColumn {
  std::size_t at = 0;                       ///< in a row
  std::string title;                        ///< as the header has it
  std::map<std::string, std::size_t> rows;  ///< of each name that it holds: how many
  [[nodiscard]] std::string names() const;  ///< "Pointer (300 rows), Scope (280 rows)"
};

/// Looks for that column, row by row. Columns are known by their names: tool, rigid_body, "Sensor ID", port; and id,
/// name or label, whose names must come again and again, for otherwise they are those of rows.
class ToolColumnSearch {
 public:
  explicit ToolColumnSearch(const std::vector<std::string>& header);
  /// Whether any column of the header could be it.
  [[nodiscard]] bool possible() const { return !candidates_.empty(); }
  void take(const std::vector<std::string>& row);
  [[nodiscard]] std::optional<ToolColumn> found() const;

 private:
  struct Candidate {
    ToolColumn column;
    bool weak = false;      ///< may hold names of rows as well
    bool too_many = false;  ///< of different names for tools
  };
  std::vector<Candidate> candidates_;
  std::size_t count_ = 0;
};

}  // namespace birdseye::host
