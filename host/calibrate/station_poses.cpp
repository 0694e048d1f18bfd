#include "host/calibrate/station_poses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "host/files/pose_collector.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using calibration::HandEyeStation;
using PosesOfStations = std::vector<std::optional<TimedPose>>;

/// A scope that is held still stands where it stood so long before; the slowest trackers measure 20 times a second.
constexpr double kSameMomentS = 0.03;

/// The file's name in whatever a program wrote of it, with and without its ending.
std::string file_of(const std::string& picture) {
  return picture.substr(picture.find_last_of("/\\") + 1);
}

Result<PosesOfStations> by_names(const PoseSet& set, std::span<const HandEyeStation> stations) {
  std::multimap<std::string, const TimedPose*> poses;
  for (const TimedPose& pose : set.poses) poses.emplace(file_of(pose.picture), &pose);
  PosesOfStations out;
  out.reserve(stations.size());
  for (const HandEyeStation& station : stations) {
    std::string name = station.name;
    if (!poses.contains(name)) name = fs::path(name).stem().string();
    const auto found = poses.find(name);
    if (poses.count(name) > 1) {
      return Error{Errc::bad_value, fmt::format("{} and {} both name the picture {}", found->second->name,
                                                std::next(found)->second->name, name)};
    }
    out.push_back(found == poses.end() ? std::nullopt : std::optional(*found->second));
  }
  return out;
}

PosesOfStations by_order(const PoseSet& set, std::size_t count) {
  PosesOfStations out(count);
  for (const TimedPose& pose : set.poses) {
    if (pose.index < count) out[pose.index] = pose;
  }
  return out;
}

PosesOfStations by_times(const PoseSet& set, std::span<const HandEyeStation> stations) {
  PosesOfStations out;
  out.reserve(stations.size());
  for (const HandEyeStation& station : stations) {
    const double time_s = *time_by_name(station.name);
    const auto nearest = std::ranges::min_element(
        set.poses, {}, [time_s](const TimedPose& pose) { return std::abs(pose.time_s - time_s); });
    const bool same = nearest != set.poses.end() && std::abs(nearest->time_s - time_s) <= kSameMomentS;
    out.push_back(same ? std::optional(*nearest) : std::nullopt);
  }
  return out;
}

/// How many poses the file has, with those that cannot be used.
std::size_t count_of(const PoseSet& set) {
  std::size_t count = set.poses.size() + set.rejected.size();
  for (const TimedPose& pose : set.poses) count = std::max(count, pose.index + 1);
  return count;
}

}  // namespace

Result<PosesOfStations> poses_of_stations(const fs::path& path, const PoseReading& how,
                                          std::span<const HandEyeStation> stations, const std::string& whose,
                                          const std::string& of_what, std::vector<std::string>& notes) {
  const auto set = read_pose_set(path, how);
  if (!set) return set.error();
  const auto tell = [&](const std::vector<std::string>& rejected) {
    for (const auto* told : {&rejected, &set->notes}) {
      for (const std::string& words : *told) notes.push_back(fmt::format("{}: {}", path.string(), words));
    }
  };
  if (!set->picture_column.empty()) {
    auto paired = by_names(*set, stations);
    if (!paired) return paired.error().with_context(path.string());
    if (std::ranges::any_of(*paired, [](const auto& pose) { return pose.has_value(); })) {
      tell(by_kind(set->rejected));
      notes.push_back(
          fmt::format("{}: its column \"{}\" names the picture of each pose", path.string(), set->picture_column));
      return paired;
    }
    notes.push_back(fmt::format("{}: its column \"{}\" names none of the {}: they pair by their order", path.string(),
                                set->picture_column, of_what));
  }
  const std::size_t count = count_of(*set);
  if (count == stations.size()) {
    tell(set->rejected);
    return by_order(*set, count);
  }
  const bool timed =
      set->timed && std::ranges::all_of(stations, [](const auto& one) { return time_by_name(one.name).has_value(); });
  if (timed) {
    tell(by_kind(set->rejected));
    notes.push_back(fmt::format("{}: poses pair with {} by time, to {:g} s: the pictures' names are times",
                                path.string(), of_what, kSameMomentS));
    return by_times(*set, stations);
  }
  return Error{
      Errc::bad_value,
      fmt::format("{} {} and {} poses of {}: they pair one by one in the order of their names, so there must be "
                  "as many; or give a table with a column \"picture\" that names each pose's picture",
                  stations.size(), of_what, count, whose)};
}

}  // namespace birdseye::host
