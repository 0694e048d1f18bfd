#include "calibration/guide/guidance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "calibration/base/median.hpp"
#include "calibration/base/units.hpp"
#include "calibration/geometry/lens_fold.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/guide/scope_move.hpp"

namespace birdseye::calibration {

namespace {

constexpr double kEighth_rad = 45 * kRadPerDeg;

template <std::size_t n>
int count_of(const std::array<bool, n>& flags) {
  return static_cast<int>(std::count(flags.begin(), flags.end(), true));
}

std::size_t sector_of(double angle_rad, double width_rad, int sectors) {
  return static_cast<std::size_t>(std::lround(angle_rad / width_rad) + 2L * sectors) %
         static_cast<std::size_t>(sectors);
}

/// A few points over the board, its corners first: where the calibration's are does not matter for comparing poses.
std::vector<Eigen::Vector3d> points_of(const Eigen::Vector3d& extent_mm) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& [x, y] : {std::pair{0.0, 0.0},
                             {1.0, 0.0},
                             {0.0, 1.0},
                             {1.0, 1.0},
                             {0.5, 0.0},
                             {0.5, 1.0},
                             {0.0, 0.5},
                             {1.0, 0.5},
                             {0.5, 0.5},
                             {0.25, 0.25},
                             {0.75, 0.25},
                             {0.25, 0.75},
                             {0.75, 0.75}}) {
    points.emplace_back(x * extent_mm.x(), y * extent_mm.y(), 0);
  }
  return points;
}

/// What is known before poses are compared.
struct PoseSearch {
  const CameraModel& camera;
  double fold;  ///< the camera's fold_radius
  std::vector<Eigen::Vector3d> points_mm;
  Eigen::Vector3d centre_mm;
  double working_mm = 0;
  double least_share = 1;
  bool from_behind = false;
};

/// How much of the board is in the picture, by its points. margin_share: of the picture's size, that they are to be
/// within its rim.
double seen_share(const PoseSearch& search, const Transform<Camera, Marker>& camera_from_marker, double margin_share) {
  const CameraModel& camera = search.camera;
  const Eigen::Vector2d size(camera.width_px, camera.height_px);
  const Eigen::Vector2d margin = margin_share * size;
  std::size_t seen = 0;
  for (const Eigen::Vector3d& point : search.points_mm) {
    const auto pixel = project_seen(camera, camera_from_marker * point, search.fold);
    if (pixel && (*pixel - margin).minCoeff() >= 0 && (size - margin - *pixel).minCoeff() >= 0) ++seen;
  }
  return static_cast<double>(seen) / static_cast<double>(search.points_mm.size());
}

/// The distance at which the whole board lies within the picture however it is turned.
double fitting_distance_mm(const CameraModel& camera, const Eigen::Vector3d& extent_mm) {
  constexpr double kShare = 0.8;  // of the picture's smaller side
  const double half_tangent = 0.5 * std::min(camera.width_px / camera.fx_px, camera.height_px / camera.fy_px);
  return 0.5 * extent_mm.head<2>().norm() / (kShare * half_tangent);
}

/// How far two poses of the scope are apart: radians, and the move of its camera over the working distance.
double apart(const Transform<Camera, Marker>& a, const Transform<Camera, Marker>& b, double working_mm) {
  const double move_mm = (a.inverse().translation() - b.inverse().translation()).norm();
  return rotation_angle_between(a.rotation(), b.rotation()) + move_mm / working_mm;
}

PoseSearch search_for(std::span<const Station> stations, const CameraModel& camera, const Eigen::Vector3d& extent_mm,
                      const std::optional<Transform<Camera, Marker>>& now) {
  PoseSearch s{camera, fold_radius(camera), points_of(extent_mm),
               0.5 * Eigen::Vector3d(extent_mm.x(), extent_mm.y(), 0)};
  s.working_mm = fitting_distance_mm(camera, extent_mm);
  constexpr double kFitted = -0.02;  // a pose that was fitted may put corners beyond the rim that were seen within
  if (now) s.from_behind = scope_view(*now).from_behind;
  if (stations.empty()) return s;
  std::vector<double> distances;
  for (const Station& station : stations) {
    distances.push_back(scope_view(station.camera_from_marker).distance_mm);
    s.least_share = std::min(s.least_share, seen_share(s, station.camera_from_marker, kFitted));
  }
  s.working_mm = median_of(distances);
  s.from_behind = scope_view(stations.front().camera_from_marker).from_behind;
  return s;
}

/// fresh: whether a direction is to be considered, as the rotation of camera_from_marker.
std::vector<Transform<Camera, Marker>> candidates(const PoseSearch& search,
                                                  const std::function<bool(const Eigen::Matrix3d&)>& fresh) {
  constexpr double kTilts_deg[] = {0, 18, 36};
  constexpr double kDistances[] = {0.8, 1.0, 1.3};  // of the working distance
  constexpr double kOffCentre = 0.18;               // of the picture
  constexpr double kMargin = 0.03;  // a pattern goes on beyond its corners, and is not found where it touches the rim
  const Eigen::Vector2d off(kOffCentre * search.camera.width_px / search.camera.fx_px,
                            kOffCentre * search.camera.height_px / search.camera.fy_px);
  std::vector<Transform<Camera, Marker>> out;
  const auto consider = [&](const ScopeView& view) {
    if (!fresh(pose_of(view, search.centre_mm, {0, 0}).rotation())) return;
    for (const auto& [x, y] : {std::pair{0, 0}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}}) {
      const auto pose = pose_of(view, search.centre_mm, {x * off.x(), y * off.y()});
      if (seen_share(search, pose, kMargin) < search.least_share) continue;
      out.push_back(pose);
    }
  };
  for (const double tilt_deg : kTilts_deg) {
    for (int direction = 0; direction < (tilt_deg > 0 ? 8 : 1); ++direction) {
      for (int turn = 0; turn < 8; ++turn) {
        for (const double distance : kDistances) {
          consider({tilt_deg * kRadPerDeg, direction * kEighth_rad, turn * kEighth_rad, distance * search.working_mm,
                    search.from_behind});
        }
      }
    }
  }
  return out;
}

StationInformation information_of(const PoseSearch& search, std::span<const Station> stations,
                                  const StationNoise& noise) {
  std::vector<Transform<Tracker, Sensor>> tracker_from_sensor;
  std::vector<Transform<Camera, Marker>> camera_from_marker;
  for (const Station& station : stations) {
    tracker_from_sensor.push_back(station.tracker_from_sensor);
    camera_from_marker.push_back(station.camera_from_marker);
  }
  StationInformation information(search.camera, search.points_mm,
                                 rough_hand_eye(tracker_from_sensor, camera_from_marker), search.working_mm, noise);
  for (const auto& pose : camera_from_marker) information.add(pose);
  information.solve();
  return information;
}

/// Every direction that no station has had, or all where none is left.
std::vector<Transform<Camera, Marker>> poses_to_compare(const PoseSearch& search, std::span<const Station> stations) {
  constexpr double kSameDirection_rad = 15 * kRadPerDeg;
  const auto poses = candidates(search, [&](const Eigen::Matrix3d& rotation) {
    return std::none_of(stations.begin(), stations.end(), [&](const Station& s) {
      return rotation_angle_between(s.camera_from_marker.rotation(), rotation) < kSameDirection_rad;
    });
  });
  return poses.empty() ? candidates(search, [](const Eigen::Matrix3d&) { return true; }) : poses;
}

/// Of the poses that are nearly as good as the best, which is the nearest to where the scope is.
std::size_t nearest_good(std::span<const Transform<Camera, Marker>> poses, std::span<const double> errors_mm,
                         double before_mm, const Transform<Camera, Marker>& from, double working_mm) {
  const double best_mm = *std::min_element(errors_mm.begin(), errors_mm.end());
  // Nearly as good: the error where one station teaches much, what it teaches where all teach little.
  constexpr double kLikeError = 1.05, kLikeGain = 0.8;
  const double most_mm = std::min(kLikeError * best_mm, before_mm - kLikeGain * (before_mm - best_mm));
  std::size_t chosen = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (errors_mm[i] > most_mm) continue;
    const double distance = apart(from, poses[i], working_mm);
    if (distance >= nearest) continue;
    nearest = distance;
    chosen = i;
  }
  return chosen;
}

/// Those that a pose was found for: one that is not finite would spoil what the others say.
std::vector<Station> finite_of(std::span<const Station> stations) {
  std::vector<Station> finite;
  for (const Station& s : stations) {
    if (s.camera_from_marker.matrix().allFinite() && s.tracker_from_sensor.matrix().allFinite()) finite.push_back(s);
  }
  return finite;
}

}  // namespace

int Coverage::cells_covered() const {
  return count_of(cells);
}
int Coverage::tilts_covered() const {
  return count_of(tilts);
}
int Coverage::turns_covered() const {
  return count_of(turns);
}
int Coverage::distances_covered() const {
  constexpr double kFurther = 1.25;
  return stations == 0 ? 0 : furthest_mm >= kFurther * nearest_mm ? 2 : 1;
}

Coverage coverage_of(std::span<const Station> stations, int width_px, int height_px) {
  constexpr double kLittle_rad = 8 * kRadPerDeg, kMuch_rad = 25 * kRadPerDeg;
  Coverage c;
  for (const Station& station : stations) {
    for (const Eigen::Vector2d& corner : station.corners_px) {
      const double column = (corner.x() + 0.5) / width_px * Coverage::kColumns;
      const double row = (corner.y() + 0.5) / height_px * Coverage::kRows;
      if (!(column >= 0 && row >= 0 && column < Coverage::kColumns && row < Coverage::kRows)) continue;
      c.cells[static_cast<std::size_t>(row) * Coverage::kColumns + static_cast<std::size_t>(column)] = true;
    }
    if (!station.camera_from_marker.matrix().allFinite()) continue;
    const ScopeView view = scope_view(station.camera_from_marker);
    if (view.tilt_rad >= kLittle_rad) {
      const std::size_t band = view.tilt_rad < kMuch_rad ? 0 : Coverage::kSectors;
      c.tilts[band + sector_of(view.direction_rad, kEighth_rad, Coverage::kSectors)] = true;
    }
    c.turns[sector_of(view.turn_rad, 2 * kEighth_rad, Coverage::kTurns)] = true;
    c.nearest_mm = c.stations == 0 ? view.distance_mm : std::min(c.nearest_mm, view.distance_mm);
    c.furthest_mm = std::max(c.furthest_mm, view.distance_mm);
    ++c.stations;
  }
  const auto of = [](int covered, std::size_t all) { return covered / static_cast<double>(all); };
  c.share = (of(c.cells_covered(), c.cells.size()) + of(c.tilts_covered(), c.tilts.size()) +
             of(c.turns_covered(), c.turns.size()) + of(c.distances_covered(), 2)) /
            4;
  return c;
}

std::string coverage_line(const Coverage& c) {
  return fmt::format("picture {} of {} cells, tilts {} of {}, turns {} of {}, distances {} of 2", c.cells_covered(),
                     c.cells.size(), c.tilts_covered(), c.tilts.size(), c.turns_covered(), c.turns.size(),
                     c.distances_covered());
}

NextPose next_best_pose(std::span<const Station> all, const CameraModel& camera, const Eigen::Vector3d& board_extent_mm,
                        const std::optional<Transform<Camera, Marker>>& said, const StationNoise& noise) {
  const std::vector<Station> stations = finite_of(all);
  const auto now = said && said->matrix().allFinite() ? said : std::nullopt;
  const PoseSearch search = search_for(stations, camera, board_extent_mm, now);
  const ScopeView straight{.distance_mm = search.working_mm, .from_behind = search.from_behind};
  const Transform<Camera, Marker> from = now.value_or(pose_of(straight, search.centre_mm, {0, 0}));
  const std::vector<Transform<Camera, Marker>> poses = poses_to_compare(search, stations);
  if (poses.empty()) return {from, std::nullopt, !now, 0};
  const StationInformation information = information_of(search, stations, noise);
  std::vector<double> errors_mm;
  errors_mm.reserve(poses.size());
  for (const auto& pose : poses) errors_mm.push_back(information.expected_error_mm(pose));
  const double before_mm = information.expected_error_mm();
  const std::size_t chosen = nearest_good(poses, errors_mm, before_mm, from, search.working_mm);
  return {poses[chosen], move_between(from, poses[chosen], camera, search.centre_mm), !now,
          1 - errors_mm[chosen] / before_mm};
}

}  // namespace birdseye::calibration
