#include "host/calibrate/hand_eye_rod.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "drivers/system/whole_file.hpp"
#include "host/files/pose_collector.hpp"

namespace birdseye::host {

namespace {

using calibration::HandEyeStation;

/// The name under which the angles have a picture; empty if they have none.
std::string name_in(const RodAngles& angles, const std::string& picture) {
  if (angles.contains(picture)) return picture;
  const std::string stem = std::filesystem::path(picture).stem().string();
  return angles.contains(stem) ? stem : "";
}

Result<std::vector<RodGroup>> groups_of(const HandEyeRecording& recording, const RodAngles& angles) {
  std::set<std::string> named;
  for (const std::string& picture : recording.pictures) named.insert(name_in(angles, picture));
  for (const auto& [name, angle] : angles) {
    if (!named.contains(name))
      return Error{Errc::bad_value, fmt::format("--rod-angles: {} is none of the pictures", name)};
  }
  std::map<double, RodGroup> by_angle;
  for (const HandEyeStation& station : recording.input.stations) {
    const std::string name = name_in(angles, station.name);
    if (name.empty()) return Error{Errc::bad_value, fmt::format("--rod-angles: no angle for {}", station.name)};
    RodGroup& group = by_angle[angles.at(name)];
    group.angle_deg = angles.at(name);
    group.stations.push_back(station);
  }
  std::vector<RodGroup> groups;
  groups.reserve(by_angle.size());
  for (auto& [angle, group] : by_angle) groups.push_back(std::move(group));
  return groups;
}

/// How far the model, and the group's own hand-eye, put apart what lies straight ahead at the board.
void compare(const RodScope& scope, double theta_rad, RodGroup& group) {
  const auto& own = group.result.camera_from_sensor;
  const auto model = scope.camera_from_sensor(theta_rad);
  const Eigen::Vector3d ahead_mm(0, 0, group.result.working_distance_mm);
  group.off_mm = (model * (own.inverse() * ahead_mm) - ahead_mm).norm();
  group.off_deg = rotation_angle_between(model.rotation(), own.rotation()) * kDegPerRad;
}

void fit_axis(RodCalibration& rod) {
  const RodGroup& zero = rod.at_reference();
  std::vector<calibration::RodStation> stations;
  for (const RodGroup& group : rod.groups) {
    if (group.result.solved)
      stations.push_back({(group.angle_deg - zero.angle_deg) * kRadPerDeg, group.result.camera_from_sensor});
  }
  const auto fit = calibration::fit_rod(stations);
  if (!fit) {
    rod.fault = fit.error().what;
    return;
  }
  rod.scope = fit->scope;
  // What is stated of the reference, its covariance and held-out error, is of this one.
  rod.scope->camera_from_sensor_at_zero = zero.result.camera_from_sensor;
  for (RodGroup& group : rod.groups) {
    if (group.result.solved) compare(*rod.scope, (group.angle_deg - zero.angle_deg) * kRadPerDeg, group);
  }
}

nlohmann::json xyz_json(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

nlohmann::json group_json(const RodGroup& group) {
  nlohmann::json out{{"angle_deg", group.angle_deg},
                     {"stations", group.stations.size()},
                     {"verdict", name_of(group.verdict.grade)},
                     {"outliers", group.result.outliers}};
  if (!group.result.solved) return out;
  const Eigen::Matrix4d matrix = group.result.camera_from_sensor.matrix();
  for (Eigen::Index r = 0; r < 4; ++r)
    out["camera_from_sensor"].push_back({matrix(r, 0), matrix(r, 1), matrix(r, 2), matrix(r, 3)});
  out.update({{"held_out_mm", group.result.held_out_mm},
              {"held_out_px", group.result.held_out_px},
              {"off_deg", group.off_deg},
              {"off_mm", group.off_mm}});
  return out;
}

}  // namespace

Result<RodAngles> read_rod_angles(const std::filesystem::path& path) {
  const auto text = read_whole_file(path, kMostTextBytes);
  if (!text) return Error{text.error().code, text.error().what + " (lines of name,angle_deg are expected)"};
  std::istringstream file(*text);
  RodAngles angles;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const std::string row(trimmed(line));
    if (row.empty() || row[0] == '#' || (number == 1 && row == "name,angle_deg")) continue;
    const std::size_t comma = row.rfind(',');
    const std::string name(trimmed(std::string_view(row).substr(0, comma)));
    const ReadNumber angle =
        read_number(comma == std::string::npos ? "" : trimmed(std::string_view(row).substr(comma + 1)));
    if (comma == std::string::npos || name.empty() || !angle.problem.empty())
      return Error{Errc::bad_format,
                   fmt::format("{}:{}: give a picture's name and an angle, as view1.png,30", path.string(), number)};
    if (!angles.emplace(name, angle.value).second)
      return Error{Errc::bad_value, fmt::format("{}:{}: a second angle for {}", path.string(), number, name)};
  }
  if (angles.empty()) return Error{Errc::bad_format, path.string() + ": holds no lines of name,angle_deg"};
  return angles;
}

Result<RodCalibration> calibrate_rod(const HandEyeRecording& recording, const RodAngles& angles) {
  auto groups = groups_of(recording, angles);
  if (!groups) return groups.error();
  RodCalibration rod{*std::move(groups), 0, std::nullopt, {}};
  calibration::HandEyeInput input = recording.input;
  for (std::size_t i = 0; i < rod.groups.size(); ++i) {
    RodGroup& group = rod.groups[i];
    input.stations = group.stations;
    auto solved = calibration::calibrate_hand_eye(input);
    if (!solved) return solved.error();
    group.result = *std::move(solved);
    group.verdict = calibration::judge(group.result);
    if (group.stations.size() > rod.at_reference().stations.size()) rod.reference = i;
  }
  if (rod.at_reference().result.solved) fit_axis(rod);
  return rod;
}

void judge_rod(const RodCalibration& rod, Verdict& verdict) {
  constexpr double kShiftPass_mm = 2, kShiftMarginal_mm = 5, kTurnPass_deg = 1, kTurnMarginal_deg = 3;
  for (const RodGroup& group : rod.groups) {
    if (&group == &rod.at_reference() || group.verdict.grade == Grade::pass) continue;
    verdict.grade = std::max(verdict.grade, group.verdict.grade);
    for (const std::string& reason : group.verdict.reasons)
      verdict.reasons.push_back(fmt::format("rod at {:g} degrees: {}", group.angle_deg, reason));
    verdict.next_steps.push_back(fmt::format("take more stations with the rod at {:g} degrees", group.angle_deg));
  }
  if (!rod.scope) {
    if (!rod.fault.empty()) verdict.add(Grade::fail, rod.fault, "take ten stations each at two angles or more");
    return;
  }
  double most_mm = 0, most_deg = 0;
  for (const RodGroup& group : rod.groups) {
    most_mm = std::max(most_mm, group.off_mm);
    most_deg = std::max(most_deg, group.off_deg);
  }
  const char* advice = "read the rod's angles off anew, and take more stations at each";
  verdict.judge("turning the rod, off at the board by", most_mm, "mm", kShiftPass_mm, kShiftMarginal_mm, advice);
  verdict.judge("turning the rod, turned wrongly by", most_deg, "degrees", kTurnPass_deg, kTurnMarginal_deg, advice);
}

nlohmann::json rod_json(const RodCalibration& rod) {
  nlohmann::json out{{"reference_angle_deg", rod.at_reference().angle_deg}, {"angles", nlohmann::json::array()}};
  for (const RodGroup& group : rod.groups) out["angles"].push_back(group_json(group));
  if (!rod.scope) return out;
  out.update({{"axis_in_sensor", xyz_json(rod.scope->axis_in_sensor)},
              {"axis_point_in_sensor_mm", xyz_json(rod.scope->axis_point_in_sensor_mm)},
              {"picture_turn", rod.scope->picture_turn}});
  return out;
}

void add_rod_to(HtmlPage& page, const RodCalibration& rod) {
  page.heading("The rod");
  page.paragraph(
      fmt::format("All figures above are of the stations with the rod at {:g} degrees. Each other angle has a hand-eye "
                  "of its own; beside it, how far the turn about the rod's axis misses it.",
                  rod.at_reference().angle_deg));
  std::vector<std::vector<std::string>> rows{
      {"rod, deg", "stations", "held out, mm", "off at the board, mm", "turned wrongly, deg", ""}};
  for (const RodGroup& group : rod.groups) {
    const bool solved = group.result.solved;
    const auto figure = [solved](double value) { return solved ? fmt::format("{:.2f}", value) : ""; };
    rows.push_back({fmt::format("{:g}", group.angle_deg), std::to_string(group.stations.size()),
                    figure(group.result.held_out_mm), figure(group.off_mm), figure(group.off_deg),
                    name_of(group.verdict.grade)});
  }
  page.table(rows);
  if (!rod.scope) return;
  const Eigen::Vector3d& axis = rod.scope->axis_in_sensor;
  const Eigen::Vector3d& point = rod.scope->axis_point_in_sensor_mm;
  page.paragraph(
      fmt::format("In the sensor's frame its axis runs along ({:.4f}, {:.4f}, {:.4f}) through ({:.2f}, "
                  "{:.2f}, {:.2f}) mm.",
                  axis.x(), axis.y(), axis.z(), point.x(), point.y(), point.z()));
}

}  // namespace birdseye::host
