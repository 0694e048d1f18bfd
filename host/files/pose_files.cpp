#include "host/files/pose_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <sstream>
#include <string_view>

#include "calibration/base/units.hpp"
#include "drivers/system/whole_file.hpp"
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

/// Of a session recording's folder: what tells it from others, and where its poses are.
constexpr const char* kRecordedEvents = "events.jsonl";
constexpr const char* kRecordedTracker = "tracker.igs.mha";

/// Whether the folder has files .csv and none .txt.
bool only_csv(const fs::path& folder) {
  const auto texts = files_matching(folder, "*.txt"), tables = files_matching(folder, "*.csv");
  return texts && texts->empty() && tables && !tables->empty();
}

/// What one file of a folder holds: a pose, or why none; and its time, where the file has one.
struct FilePose {
  ReadPose pose;
  std::optional<double> time_s;
};

/// The pose of a file: a 4x4 matrix, or a table of one row.
FilePose pose_of_file(const fs::path& file, const PoseReading& how) {
  const auto whole = read_whole_file(file, kMostTextBytes);
  if (!whole) return {{{}, whole.error().what}, std::nullopt};
  std::istringstream in(*whole);
  std::string text, line;
  while (std::getline(in, line)) {
    if (!line.starts_with('#')) text += line + "\n";
  }
  ReadPose matrix = read_matrix(text, how.mm_per_unit, how.column_major);
  if (matrix.problem.empty() || file.extension() != ".csv") return {corrected(std::move(matrix), how), std::nullopt};
  const auto table = read_pose_table(file, how);
  if (!table) return {{{}, matrix.problem}, std::nullopt};
  const std::size_t rows = table->poses.size() + table->rejected.size();
  if (rows != 1) return {{{}, fmt::format("{} rows where each file of a folder holds one pose", rows)}, std::nullopt};
  const TimedPose& pose = table->poses.front();
  return {{pose.tracker_from_sensor, {}}, table->timed ? std::optional<double>(pose.time_s) : std::nullopt};
}

Result<PoseSet> read_files(const fs::path& folder, const std::vector<fs::path>& files, const PoseReading& how) {
  std::vector<FilePose> poses;
  poses.reserve(files.size());
  for (const fs::path& file : files) {
    poses.push_back(pose_of_file(file, how));
    if (!poses.back().time_s) poses.back().time_s = time_by_name(file);
  }
  const bool timed = std::ranges::all_of(
      poses, [](const FilePose& one) { return one.time_s.has_value() || !one.pose.problem.empty(); });
  const bool any_time = std::ranges::any_of(poses, [](const FilePose& one) { return one.time_s.has_value(); });
  PoseCollector collector(timed && any_time, how.most_error_mm);
  for (std::size_t i = 0; i < files.size(); ++i) {
    const double time_s = timed && any_time ? poses[i].time_s.value_or(0) : static_cast<double>(i);
    collector.add(files[i].filename().string(), time_s, time_s, poses[i].pose);
  }
  return std::move(collector).finish(folder);
}

Result<PoseSet> read_folder(const fs::path& folder, const std::string& pattern, const PoseReading& how) {
  if (!how.transform.empty()) {
    return Error{Errc::bad_value,
                 fmt::format("{}: --{}tool {}: a folder with one pose in each file names no tool: leave the option out",
                             folder.string(), how.option_prefix, how.transform)};
  }
  const auto found = files_matching(folder, pattern);
  if (!found) return found.error();
  if (!found->empty()) return read_files(folder, *found, how);
  return Error{Errc::not_found,
               fmt::format("{}: has no files {}; one 4x4 matrix in each is expected", folder.string(), pattern)};
}

/// Refuses what programs save in a form of their own, by its first bytes.
Result<void> refuse_binary(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string first(8, '\0');
  in.read(first.data(), static_cast<std::streamsize>(first.size()));
  if (first.starts_with("\x93NUMPY")) {
    return Error{Errc::unsupported,
                 fmt::format("{}: is an array that NumPy saved, which is not read: write it as text, a matrix a row: "
                             "numpy.savetxt(\"poses.txt\", poses.reshape(-1, 16))",
                             path.string())};
  }
  if (first.starts_with("MATLAB") || first.starts_with("\x89HDF")) {
    return Error{Errc::unsupported,
                 fmt::format("{}: is a file of MATLAB or HDF5, which is not read: write the poses as text, 16 numbers "
                             "of a matrix a row",
                             path.string())};
  }
  return {};
}

}  // namespace

std::optional<double> time_by_name(const fs::path& file) {
  const std::string stem = file.stem().string();
  if (stem.size() < 16 || stem.size() > 19 || !std::all_of(stem.begin(), stem.end(), is_digit)) return std::nullopt;
  return static_cast<double>(std::stoll(stem)) / kNsPerSecond;
}

Result<void> refuse_alike(const fs::path& a, const PoseSet& of_a, const fs::path& b, const PoseSet& of_b) {
  const auto pose_of = [](const TimedPose& one) { return one.tracker_from_sensor.matrix(); };
  if (!std::ranges::equal(of_a.poses, of_b.poses, {}, pose_of, pose_of)) return {};
  return Error{Errc::bad_value,
               fmt::format("{} and {}: hold the same poses to the last digit: one of the two stands in "
                           "the other's place",
                           a.string(), b.string())};
}

Result<PoseSet> read_pose_set(const fs::path& path, const PoseReading& how) {
  std::error_code ignored;
  const bool folder = fs::is_directory(path, ignored);
  const std::string name = path.filename().string();
  const bool many = folder || is_pattern(name);
  if (!many && !fs::is_regular_file(path, ignored))
    return Error{Errc::not_found, fmt::format("{}: no such file or folder", path.string())};
  if (!many) {
    if (const auto text = refuse_binary(path); !text) return text.error();
  }
  if (!how.body.empty() && many)
    return Error{Errc::bad_value, fmt::format("{}: --body needs a table of the body's tracked points", path.string())};
  if (!how.body.empty() && !how.transform.empty()) {
    return Error{Errc::bad_value,
                 fmt::format("{}: --{}tool {}: --{}body says whose points these are: leave --{}tool out", path.string(),
                             how.option_prefix, how.transform, how.option_prefix, how.option_prefix)};
  }
  if (!how.body.empty() && how.inverted) {
    return Error{Errc::bad_value,
                 fmt::format("{}: --poses-are sensor_from_tracker: points that were tracked have no other direction: "
                             "leave it out beside --body",
                             path.string())};
  }
  if (!how.body.empty() && how.column_major)
    return Error{Errc::bad_value, fmt::format("{}: --column-major goes with matrices: leave it out", path.string())};
  if (!how.body.empty()) return read_body_poses(path, how);
  if (folder && fs::exists(path / kRecordedEvents, ignored)) return read_sequence(path / kRecordedTracker, how);
  const bool sequence = !many && is_sequence(path), log = !many && !sequence && is_ndi_log(path);
  if (how.s_per_unit && (many || sequence || log))
    return Error{Errc::bad_value, fmt::format("{}: --time-unit goes with tables: leave it out", path.string())};
  if (how.column_major && (sequence || log))
    return Error{Errc::bad_value,
                 fmt::format("{}: --column-major goes with matrices in text: leave it out", path.string())};
  if (log && how.mm_per_unit != 1)
    return Error{Errc::bad_value, fmt::format("{}: an NDI log is in mm: leave --unit out", path.string())};
  if (sequence) return read_sequence(path, how);
  if (log) return read_ndi_log(path, how);
  if (!how.reference.empty()) {
    return Error{Errc::bad_value, fmt::format("{}: holds no transforms, of which --reference needs two: give a "
                                              "PLUS sequence or an NDI log",
                                              path.string())};
  }
  if (folder) return read_folder(path, only_csv(path) ? "*.csv" : "*.txt", how);
  if (many) return read_folder(path.has_parent_path() ? path.parent_path() : fs::path("."), name, how);
  return read_pose_table(path, how);
}

}  // namespace birdseye::host
