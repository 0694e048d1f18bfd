#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// A line of a text table that is not blank.
struct TextRow {
  std::size_t line = 0;             ///< from 1
  bool remark = false;              ///< begins with #, which the fields have no more
  std::vector<std::string> fields;  ///< without the blanks and quotes about them
};

/// Reads a table of text line by line, as programs of all kinds write them: fields are separated by tabs or semicolons,
/// else by commas, else by blanks, whichever the line has. Where tabs, semicolons or quotes separate, 1,5 is a number
/// with a decimal comma: it comes as 1.5. Ends of lines as DOS has them, a byte order mark and a first line "sep=;" are
/// passed over.
class TextRows {
 public:
  /// Refuses, naming the file, what is not there, cannot be opened, cannot be read to its end, is larger than 1 GB
  /// or is written in UTF-16.
  static Result<TextRows> open(const std::filesystem::path& path);

  /// The next line that is not blank; none at the end.
  std::optional<TextRow> next();
  /// Whether any number so far had a decimal comma.
  [[nodiscard]] bool decimal_commas() const { return decimal_commas_; }

 private:
  explicit TextRows(std::ifstream file) : file_(std::move(file)) {}
  std::vector<std::string> fields_of(std::string_view line);

  std::ifstream file_;
  std::size_t line_ = 0;
  bool decimal_commas_ = false;
};

/// Takes away empty fields at the end beyond so many: what a separator at the end of a line makes.
void drop_empty_ends(std::vector<std::string>& fields, std::size_t count);

}  // namespace birdseye::host
