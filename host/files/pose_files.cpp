#include "host/files/pose_files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
#include <sstream>
#include <string_view>

#include "calibration/base/units.hpp"
#include "host/files/name_order.hpp"
#include "host/files/pose_collector.hpp"
#include "host/files/pose_sequence.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

/// Whether name is what pattern says, in which each * stands for any letters.
bool matches(std::string_view name, std::string_view pattern) {
  const auto star = pattern.find('*');
  if (star == std::string_view::npos) return name == pattern;
  if (!name.starts_with(pattern.substr(0, star))) return false;
  const std::string_view rest = pattern.substr(star + 1);
  for (std::size_t at = star; at <= name.size(); ++at) {
    if (matches(name.substr(at), rest)) return true;
  }
  return false;
}

/// The files' times where each name is a whole number of nanoseconds since 1970, which has at least 16 digits.
std::optional<double> time_by_name(const fs::path& file) {
  const std::string stem = file.stem().string();
  if (stem.size() < 16 || stem.size() > 19 || !std::all_of(stem.begin(), stem.end(), is_digit)) return std::nullopt;
  return static_cast<double>(std::stoll(stem)) / kNsPerSecond;
}

Result<PoseSet> read_folder(const fs::path& folder, const std::string& pattern, double mm_per_unit) {
  std::vector<fs::path> files;
  std::error_code failed;
  for (fs::directory_iterator at(folder, failed); !failed && at != fs::directory_iterator(); at.increment(failed)) {
    if (matches(at->path().filename().string(), pattern)) files.push_back(at->path());
  }
  if (failed) return Error{Errc::unreadable, fmt::format("{}: cannot be read as a folder", folder.string())};
  if (files.empty()) {
    return Error{Errc::not_found,
                 fmt::format("{}: has no files {}; one 4x4 matrix in each is expected", folder.string(), pattern)};
  }
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return before_by_number(a.filename().string(), b.filename().string());
  });
  const bool timed = std::all_of(files.begin(), files.end(), time_by_name);
  PoseCollector collector(timed);
  for (std::size_t i = 0; i < files.size(); ++i) {
    std::ifstream in(files[i]);
    std::string text, line;
    while (std::getline(in, line)) {
      if (!line.starts_with('#')) text += line + "\n";
    }
    const double time_s = timed ? *time_by_name(files[i]) : static_cast<double>(i);
    collector.add(files[i].filename().string(), time_s, time_s, read_matrix(text, mm_per_unit));
  }
  return std::move(collector).finish(folder);
}

/// At commas, semicolons or tabs, whichever the line has; else at blanks.
std::vector<std::string_view> split(std::string_view line) {
  constexpr std::string_view kBlank = " \t\r";
  const bool separated = line.find_first_of(",;\t") != std::string_view::npos;
  std::vector<std::string_view> fields;
  while (true) {
    const auto first = line.find_first_not_of(separated ? " \r" : kBlank);
    line.remove_prefix(std::min(first, line.size()));
    if (line.empty() && (!separated || fields.empty())) break;
    const auto end = line.find_first_of(separated ? ",;\t" : kBlank);
    std::string_view field = line.substr(0, end);
    while (!field.empty() && kBlank.find(field.back()) != std::string_view::npos) field.remove_suffix(1);
    fields.push_back(field);
    if (end == std::string_view::npos) break;
    line.remove_prefix(end + 1);
  }
  return fields;
}

constexpr std::size_t kColumns = 8;
constexpr std::array<std::string_view, kColumns> kNames{"t", "x", "y", "z", "qx", "qy", "qz", "qw"};

/// Where in a row each of kNames is.
struct Columns {
  std::array<std::size_t, kColumns> at{0, 1, 2, 3, 4, 5, 6, 7};
  std::size_t count = kColumns;
};

Result<Columns> columns_of(const std::vector<std::string_view>& header, const fs::path& path) {
  Columns columns;
  columns.count = header.size();
  std::vector<std::string_view> lacking;
  for (std::size_t c = 0; c < kColumns; ++c) {
    const auto found = std::find_if(header.begin(), header.end(), [&](std::string_view name) {
      if (name == kNames[c]) return true;
      if (c == 0) return name == "time" || name == "time_s" || name == "timestamp";
      return c < 4 && name == std::string(kNames[c]) + "_mm";
    });
    if (found == header.end()) lacking.push_back(kNames[c]);
    columns.at[c] = static_cast<std::size_t>(found - header.begin());
  }
  if (lacking.empty()) return columns;
  return Error{Errc::bad_format, fmt::format("{}: its header lacks {}; the columns are {}", path.string(),
                                             fmt::join(lacking, ", "), fmt::join(kNames, ","))};
}

ReadPose pose_of(const std::array<double, kColumns>& v, double mm_per_unit) {
  return checked_pose(Eigen::Quaterniond(v[7], v[4], v[5], v[6]), Eigen::Vector3d(v[1], v[2], v[3]), mm_per_unit);
}

void take_row(const std::string& name, const std::vector<std::string_view>& row, const Columns& columns,
              double mm_per_unit, PoseCollector& collector) {
  if (row.size() != columns.count) {
    const std::string problem = read_number(row[row.size() > 1 ? 1 : 0]).problem;
    if (row.size() <= 2 && (problem == "missing" || problem == "INVALID")) return collector.reject(name, problem);
    return collector.reject(name, fmt::format("{} numbers where a row has {}", row.size(), columns.count));
  }
  std::array<double, kColumns> values{};
  for (std::size_t c = 0; c < kColumns; ++c) {
    const ReadNumber number = read_number(row[columns.at[c]]);
    if (!number.problem.empty()) return collector.reject(name, number.problem);
    values[c] = number.value;
  }
  collector.add(name, values[0], values[0], pose_of(values, mm_per_unit));
}

Result<PoseSet> read_csv(const fs::path& path, double mm_per_unit) {
  std::ifstream in(path);
  if (!in) return Error{Errc::unreadable, fmt::format("{}: cannot be opened; check its permissions", path.string())};
  PoseCollector collector(true);
  Columns columns;
  std::string line;
  bool first = true;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    if (number == 1 && line.starts_with("\xEF\xBB\xBF")) line.erase(0, 3);  // the mark that Windows puts before UTF-8
    const auto row = split(line);
    if (row.empty() || row[0].starts_with('#')) continue;
    const bool header = first && !row[0].empty() && read_number(row[0]).problem.ends_with("is no number");
    first = false;
    if (header) {
      auto named = columns_of(row, path);
      if (!named) return named.error();
      columns = *named;
      continue;
    }
    take_row(fmt::format("line {}", number), row, columns, mm_per_unit, collector);
  }
  return std::move(collector).finish(path);
}

}  // namespace

Result<PoseSet> read_pose_set(const fs::path& path, const std::string& transform, double mm_per_unit) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) return read_folder(path, "*.txt", mm_per_unit);
  const std::string name = path.filename().string();
  if (name.find('*') != std::string::npos)
    return read_folder(path.has_parent_path() ? path.parent_path() : fs::path("."), name, mm_per_unit);
  if (!fs::is_regular_file(path, ignored))
    return Error{Errc::not_found, fmt::format("{}: no such file or folder", path.string())};
  if (is_sequence(path)) return read_sequence(path, transform, {}, mm_per_unit);
  return read_csv(path, mm_per_unit);
}

}  // namespace birdseye::host
