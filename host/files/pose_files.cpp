#include "host/files/pose_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <string_view>

#include "calibration/base/units.hpp"
#include "host/files/body_points.hpp"
#include "host/files/name_order.hpp"
#include "host/files/name_pattern.hpp"
#include "host/files/ndi_log.hpp"
#include "host/files/pose_collector.hpp"
#include "host/files/pose_sequence.hpp"
#include "host/files/pose_table.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

/// The files' times where each name is a whole number of nanoseconds since 1970, which has at least 16 digits.
std::optional<double> time_by_name(const fs::path& file) {
  const std::string stem = file.stem().string();
  if (stem.size() < 16 || stem.size() > 19 || !std::all_of(stem.begin(), stem.end(), is_digit)) return std::nullopt;
  return static_cast<double>(std::stoll(stem)) / kNsPerSecond;
}

Result<PoseSet> read_folder(const fs::path& folder, const std::string& pattern, const PoseReading& how) {
  const auto found = files_matching(folder, pattern);
  if (!found) return found.error();
  const std::vector<fs::path>& files = *found;
  if (files.empty()) {
    return Error{Errc::not_found,
                 fmt::format("{}: has no files {}; one 4x4 matrix in each is expected", folder.string(), pattern)};
  }
  const bool timed = std::all_of(files.begin(), files.end(), time_by_name);
  PoseCollector collector(timed, how.most_error_mm);
  for (std::size_t i = 0; i < files.size(); ++i) {
    std::ifstream in(files[i]);
    std::string text, line;
    while (std::getline(in, line)) {
      if (!line.starts_with('#')) text += line + "\n";
    }
    const double time_s = timed ? *time_by_name(files[i]) : static_cast<double>(i);
    collector.add(files[i].filename().string(), time_s, time_s,
                  corrected(read_matrix(text, how.mm_per_unit), how.field));
  }
  return std::move(collector).finish(folder);
}

}  // namespace

Result<PoseSet> read_pose_set(const fs::path& path, const PoseReading& how) {
  std::error_code ignored;
  const bool folder = fs::is_directory(path, ignored);
  const std::string name = path.filename().string();
  const bool many = folder || is_pattern(name);
  if (!many && !fs::is_regular_file(path, ignored))
    return Error{Errc::not_found, fmt::format("{}: no such file or folder", path.string())};
  if (!how.body.empty() && many)
    return Error{Errc::bad_value, fmt::format("{}: --body needs a table of the body's tracked points", path.string())};
  if (!how.body.empty()) return read_body_poses(path, how);
  if (!many && is_sequence(path)) return read_sequence(path, how);
  if (!many && is_ndi_log(path)) return read_ndi_log(path, how);
  if (!how.reference.empty()) {
    return Error{Errc::bad_value, fmt::format("{}: holds no transforms, of which --reference needs two: give a "
                                              "PLUS sequence or an NDI log",
                                              path.string())};
  }
  if (folder) return read_folder(path, "*.txt", how);
  if (many) return read_folder(path.has_parent_path() ? path.parent_path() : fs::path("."), name, how);
  return read_pose_table(path, how);
}

}  // namespace birdseye::host
