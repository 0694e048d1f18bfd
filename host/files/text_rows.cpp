#include "host/files/text_rows.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "drivers/system/next_line.hpp"
#include "drivers/system/whole_file.hpp"
#include "host/files/name_order.hpp"
#include "host/files/pose_collector.hpp"

namespace birdseye::host {

namespace {

constexpr std::uintmax_t kMostBytes = 1'000'000'000;
constexpr std::size_t kLongestRow = std::size_t{1} << 20U;

/// Whoever reads a table keeps its rows: a file of gigabytes without ends of lines, or of nothing but these, would take
/// several times as much memory.
Result<void> check_lines(std::istream& in) {
  constexpr std::size_t kMostLines = 4'000'000;  // eleven hours of a tracker
  std::string line;
  std::size_t number = 1;
  for (; next_line(in, line, kLongestRow); ++number) {
    if (number > kMostLines)
      return Error{Errc::unsupported, fmt::format("has more than {} lines; give a part of it", kMostLines)};
  }
  if (in.bad()) return Error{Errc::unreadable, kNotReadToItsEnd};
  if (in.eof()) return {};
  return Error{Errc::bad_format, fmt::format("line {} is longer than any line of a table; is it a text?", number)};
}

/// Whether text is a number with a comma in the place of its point, as 1,5 or -3,7E+02.
bool has_decimal_comma(std::string_view text) {
  const auto comma = text.find(',');
  if (comma == std::string_view::npos || text.find_first_of(",.", comma + 1) != std::string_view::npos) return false;
  return text.find_first_not_of("0123456789+-eE,") == std::string_view::npos &&
         std::any_of(text.begin(), text.end(), is_digit) && comma + 1 < text.size() && is_digit(text[comma + 1]);
}

/// The separators of the line: those outside quotes.
std::string_view separators_of(std::string_view line) {
  bool quoted = false, comma = false;
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    if (quoted) continue;
    if (c == ';' || c == '\t') return ";\t";
    comma = comma || c == ',';
  }
  return comma ? "," : " ";
}

}  // namespace

void drop_empty_ends(std::vector<std::string>& fields, std::size_t count) {
  while (fields.size() > count && fields.back().empty()) fields.pop_back();
}

Result<TextRows> TextRows::open(const std::filesystem::path& path) {
  if (const auto opened = open_file(path); !opened) return opened.error();
  std::error_code ignored;
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{Errc::unreadable, fmt::format("{}: cannot be opened; check its permissions", path.string())};
  if (std::filesystem::file_size(path, ignored) > kMostBytes)
    return Error{Errc::unsupported, fmt::format("{}: is larger than 1 GB; give a part of it", path.string())};
  if (auto checked = check_lines(file); !checked) return checked.error().with_context(path.string());
  file.clear();
  file.seekg(0);
  std::string mark(3, '\0');
  file.read(mark.data(), 3);
  if (mark.starts_with("\xFF\xFE") || mark.starts_with("\xFE\xFF"))
    return Error{Errc::unsupported, fmt::format("{}: is text in UTF-16; save it as UTF-8", path.string())};
  file.clear();
  if (mark != "\xEF\xBB\xBF") file.seekg(0);
  return TextRows(std::move(file));
}

std::vector<std::string> TextRows::fields_of(std::string_view line) {
  const std::string_view separators = separators_of(line);
  std::vector<std::string> fields(1);
  bool quoted = false, was_quoted = false;
  const auto end_field = [&] {
    std::string& field = fields.back();
    field = trimmed(field);
    if (separators != "," && field.size() > 1 && field.back() == ',')
      field = trimmed(field.substr(0, field.size() - 1));
    if ((separators == ";\t" || was_quoted) && has_decimal_comma(field)) {
      std::replace(field.begin(), field.end(), ',', '.');
      decimal_commas_ = true;
    }
    was_quoted = false;
  };
  for (const char c : trimmed(line).empty() ? line : line.substr(0, line.find_last_not_of("\r\n") + 1)) {
    if (c == '"') {
      quoted = !quoted;
      was_quoted = true;
    } else if (!quoted && separators.find(c) != std::string_view::npos) {
      if (separators == " " && fields.back().empty()) continue;  // blanks in a row are one
      end_field();
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  end_field();
  if (separators == " ") drop_empty_ends(fields, 1);
  return fields;
}

std::optional<TextRow> TextRows::next() {
  std::string text;
  while (std::getline(file_, text)) {
    ++line_;
    std::string_view line = text;
    if (trimmed(line).empty()) continue;
    if (line_ == 1 && trimmed(line).starts_with("sep=")) continue;  // what spreadsheets say of the separator
    TextRow row;
    row.line = line_;
    row.remark = trimmed(line).front() == '#';
    if (row.remark) line.remove_prefix(line.find('#') + 1);
    row.fields = fields_of(line);
    return row;
  }
  return std::nullopt;
}

}  // namespace birdseye::host
