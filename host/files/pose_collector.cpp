#include "host/files/pose_collector.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>

#include "calibration/base/lower_case.hpp"
#include "calibration/geometry/rigid_matrix.hpp"
#include "host/files/text_rows.hpp"

namespace birdseye::host {

namespace {

/// How far a recorded rotation may be from one: files with three decimals pass, and at 400 mm from the sensor that is
/// 0.4 mm.
constexpr double kRotationTolerance = 1e-3;

/// What is wrong with a position, if anything.
std::string problem_of(const Eigen::Vector3d& position_mm, double mm_per_unit) {
  if (!position_mm.allFinite()) return "not finite";
  // No tracker sees so far; what is beyond stands for "not seen", as NDI's -3.697314E28 does.
  const double farthest_mm = position_mm.cwiseAbs().maxCoeff();
  if (farthest_mm <= kFarthestMm) return {};
  Eigen::Index which = 0;
  position_mm.cwiseAbs().maxCoeff(&which);
  if (farthest_mm <= kFarthestMm * mm_per_unit) {
    return fmt::format(
        "{:.6g} mm is no position; {:.6g} mm is one: the unit of lengths (--unit, or of the header) is "
        "likely not the file's",
        position_mm[which], position_mm[which] / mm_per_unit);
  }
  return fmt::format("{:.6g} mm is no position (a stand-in for a missing one)", position_mm[which]);
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const auto first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

ReadNumber read_number(std::string_view text) {
  text = trimmed(text);
  const std::string lower = lower_case(text);
  for (const std::string_view word : {"", "missing", "invalid", "na", "n/a", "none", "null"}) {
    if (lower == word) return {0, lower == "invalid" ? "INVALID" : "missing"};
  }
  if (text.size() > 1 && text[0] == '+') text.remove_prefix(1);
  ReadNumber out;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out.value);
  const bool beyond = error == std::errc::result_out_of_range;
  if (!beyond && (error != std::errc() || end != text.data() + text.size())) {
    out.problem = fmt::format("\"{}\" is no number", text.substr(0, 40));
  } else if (beyond || !std::isfinite(out.value)) {
    out.problem = "not finite";
  }
  return out;
}

ReadPose checked_pose(const Eigen::Matrix4d& matrix, double mm_per_unit) {
  ReadPose out;
  if (!matrix.allFinite()) {
    out.problem = "not finite";
    return out;
  }
  const Eigen::Matrix3d r = matrix.topLeftCorner<3, 3>();
  const Eigen::Vector3d position_mm = mm_per_unit * matrix.topRightCorner<3, 1>();
  out.problem = problem_of(position_mm, mm_per_unit);
  if (!out.problem.empty()) return out;
  const double off = (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off <= 2 * kRotationTolerance)) {
    out.problem = kNoRotation;
  } else if (r.determinant() < 0) {
    out.problem =
        "no rotation but a mirror (determinant -1), as of a left-handed frame or with two axes exchanged: have the "
        "program that writes it write a right-handed frame";
  } else if ((matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() > 1e-9) {
    out.problem = kNoLastRow;
  }
  out.tracker_from_sensor = Transform<Tracker, Sensor>(r, position_mm);
  return out;
}

ReadPose checked_pose(const Eigen::Quaterniond& quaternion, const Eigen::Vector3d& position, double mm_per_unit) {
  ReadPose out;
  const Eigen::Vector3d position_mm = mm_per_unit * position;
  out.problem = quaternion.coeffs().allFinite() ? problem_of(position_mm, mm_per_unit) : "not finite";
  if (!out.problem.empty()) return out;
  if (std::abs(quaternion.norm() - 1) > kRotationTolerance) {
    out.problem = fmt::format("its quaternion has length {:.4g} where a rotation has 1", quaternion.norm());
    return out;
  }
  out.tracker_from_sensor = Transform<Tracker, Sensor>(quaternion, position_mm);
  return out;
}

std::string written_other_way(bool column_major) {
  return column_major ? "it is written row by row: leave --column-major out"
                      : "it is written column by column: say --column-major, or write it row by row";
}

ReadPose read_matrix(std::string_view text, double mm_per_unit, bool column_major) {
  std::array<double, 16> numbers{};
  std::size_t count = 0;
  ReadPose out;
  for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
    const std::string_view word = text.substr(0, text.find_first_of(" \t\r\n,;"));
    const ReadNumber number = read_number(word);
    if (!number.problem.empty()) {
      out.problem = number.problem;
      return out;
    }
    if (count < numbers.size()) numbers[count] = number.value;
    ++count;
    text.remove_prefix(std::min(text.size(), word.size() + 1));
  }
  if (count != numbers.size()) {
    out.problem = count == 0 ? "missing" : fmt::format("{} numbers where a 4x4 matrix has 16", count);
    return out;
  }
  const Eigen::Map<const Eigen::Matrix4d> by_columns(numbers.data());
  const Eigen::Matrix4d by_rows = by_columns.transpose();
  out = checked_pose(column_major ? by_columns : by_rows, mm_per_unit);
  if (out.problem.empty() || !checked_pose(column_major ? by_rows : by_columns, mm_per_unit).problem.empty())
    return out;
  out.problem = written_other_way(column_major);
  return out;
}

ReadPose corrected(ReadPose pose, const PoseReading& how) {
  if (!pose.problem.empty()) return pose;
  if (how.inverted) {
    const auto sensor_from_tracker = Transform<Sensor, Tracker>::from_matrix(pose.tracker_from_sensor.matrix());
    pose.tracker_from_sensor = sensor_from_tracker.inverse();
  }
  const auto& field = how.field;
  if (!field) return pose;
  if (const auto by_map = field->correct(pose.tracker_from_sensor)) {
    pose.tracker_from_sensor = by_map->tracker_from_sensor;
  } else {
    pose.problem = field->why_not(pose.tracker_from_sensor.translation());
    pose.unmapped = true;
  }
  return pose;
}

ReadPose against(const ReadPose& sensor, const std::string& sensor_name, const ReadPose& reference,
                 const std::string& reference_name) {
  if (!sensor.problem.empty()) return {{}, sensor_name + " " + sensor.problem, sensor.unmapped};
  if (!reference.problem.empty()) return {{}, reference_name + " " + reference.problem, reference.unmapped};
  const auto tracker_from_reference = Transform<Tracker, Marker>::from_matrix(reference.tracker_from_sensor.matrix());
  const Transform<Marker, Sensor> relative = tracker_from_reference.inverse() * sensor.tracker_from_sensor;
  ReadPose out = sensor;
  out.tracker_from_sensor = Transform<Tracker, Sensor>(relative.rotation(), relative.translation());
  if (sensor.error_mm && reference.error_mm) out.error_mm = std::max(*sensor.error_mm, *reference.error_mm);
  return out;
}

std::vector<std::string> by_kind(const std::vector<std::string>& rejected) {
  struct Kind {
    std::string first;
    std::size_t count = 0;
  };
  std::map<std::string, Kind> kinds;
  for (const std::string& line : rejected) {
    std::string kind = line;
    std::erase_if(kind, [](unsigned char c) { return std::isdigit(c) != 0; });
    Kind& of_line = kinds[kind];
    if (of_line.count++ == 0) of_line.first = line;
  }
  std::vector<std::string> out;
  out.reserve(kinds.size());
  for (const auto& [name, kind] : kinds)
    out.push_back(kind.count > 1 ? fmt::format("{} (and {} more like it)", kind.first, kind.count - 1) : kind.first);
  return out;
}

void PoseCollector::add(const std::string& name, double time_s, double unfiltered_time_s, const ReadPose& pose,
                        const std::string& picture) {
  if (pose.unmapped) ++unmapped_;
  if (!pose.problem.empty()) return reject(name, pose.problem);
  if (!std::isfinite(time_s) || !std::isfinite(unfiltered_time_s)) return reject(name, "has no time");
  if (pose.error_mm) errors_mm_.push_back(*pose.error_mm);
  if (pose.error_mm && most_error_mm_ && !(*pose.error_mm <= *most_error_mm_))
    return reject(name, fmt::format("its error of {:.3g} mm is over {:.3g} mm", *pose.error_mm, *most_error_mm_));
  set_.poses.push_back(
      {name, next_index_++, time_s, unfiltered_time_s, pose.tracker_from_sensor, pose.error_mm, picture});
}

void PoseCollector::reject(const std::string& name, const std::string& why) {
  set_.rejected.push_back(name + ": " + why);
  ++next_index_;
}

void PoseCollector::sort_by_time() {
  auto& poses = set_.poses;
  const auto earlier = [](const TimedPose& a, const TimedPose& b) { return a.time_s < b.time_s; };
  const auto back = std::adjacent_find(poses.begin(), poses.end(), [&](auto& a, auto& b) { return earlier(b, a); });
  if (back != poses.end()) {
    set_.notes.push_back(fmt::format("times go back after {}: put in the order of their times", back->name));
    std::stable_sort(poses.begin(), poses.end(), earlier);
  }
  // One time cannot have two poses, and which of them is right cannot be known: the first one recorded stays.
  std::vector<TimedPose> kept;
  std::size_t shared = 0;
  for (TimedPose& pose : poses) {
    if (!kept.empty() && kept.back().time_s == pose.time_s) {
      ++shared;
      set_.rejected.push_back(fmt::format("{}: has the time of {}", pose.name, kept.back().name));
    } else {
      kept.push_back(std::move(pose));
    }
  }
  note_shared_times(shared);
  poses = std::move(kept);
}

void PoseCollector::note_shared_times(std::size_t shared) {
  constexpr std::size_t kOneIn = 10;
  if (shared == 0 || shared * kOneIn < set_.poses.size()) return;
  set_.notes.push_back(
      fmt::format("{} of {} rows have the time of another row: has the file poses of several tools, or have its times "
                  "too few digits?",
                  shared, set_.poses.size()));
}

void PoseCollector::note_repeated_poses() {
  std::size_t repeats = 0;
  std::string first;
  for (std::size_t i = 1; i < set_.poses.size(); ++i) {
    if (set_.poses[i].tracker_from_sensor.matrix() != set_.poses[i - 1].tracker_from_sensor.matrix()) continue;
    if (repeats++ == 0) first = set_.poses[i].name;
  }
  if (repeats > 0) {
    set_.notes.push_back(
        fmt::format("{} of {} poses repeat the one before to the last digit, first {}: one reading recorded twice",
                    repeats, set_.poses.size(), first));
  }
}

void PoseCollector::note_unmapped_poses() {
  if (unmapped_ == 0) return;
  set_.notes.push_back(fmt::format("{} of {} poses lie where the field was not mapped, and are left out", unmapped_,
                                   set_.poses.size() + set_.rejected.size()));
}

void PoseCollector::note_errors() {
  if (errors_mm_.empty()) return;
  std::sort(errors_mm_.begin(), errors_mm_.end());
  std::string words = fmt::format("errors of its poses: median {:.3g} mm, largest {:.3g} mm",
                                  errors_mm_[errors_mm_.size() / 2], errors_mm_.back());
  if (most_error_mm_) {
    const auto over = errors_mm_.end() - std::upper_bound(errors_mm_.begin(), errors_mm_.end(), *most_error_mm_);
    words += fmt::format("; {} of {} are over {:.3g} mm, and left out", over, errors_mm_.size(), *most_error_mm_);
  }
  set_.notes.push_back(std::move(words));
}

Result<PoseSet> PoseCollector::finish(const std::filesystem::path& path) && {
  if (set_.timed) sort_by_time();
  note_repeated_poses();
  note_unmapped_poses();
  note_errors();
  if (most_error_mm_ && errors_mm_.empty() && !set_.poses.empty()) {
    return Error{Errc::bad_value,
                 fmt::format("{}: tells no errors of its poses: leave --max-error out", path.string())};
  }
  if (!set_.poses.empty()) return std::move(set_);
  if (set_.rejected.empty()) return Error{Errc::bad_format, fmt::format("{}: holds no poses", path.string())};
  if (set_.rejected.size() == 1)
    return Error{Errc::bad_value, fmt::format("{}: its one pose cannot be used; {}", path.string(), set_.rejected[0])};
  return Error{Errc::bad_value, fmt::format("{}: none of {} poses can be used; {}", path.string(), set_.rejected.size(),
                                            fmt::join(by_kind(set_.rejected), "; "))};
}

}  // namespace birdseye::host
