#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "calibration/guide/scope_move.hpp"
#include "calibration/guide/station_information.hpp"

namespace birdseye::calibration {

/// One moment at rest of a hand-eye calibration: where the tracker had the sensor, and where the picture had the board.
struct Station {
  Transform<Tracker, Sensor> tracker_from_sensor;
  Transform<Camera, Marker> camera_from_marker;
  std::vector<Eigen::Vector2d> corners_px;
};

/// What the stations so far cover.
struct Coverage {
  static constexpr int kColumns = 5, kRows = 4;
  static constexpr int kSectors = 8;
  static constexpr int kTurns = 4;
  std::array<bool, std::size_t{kColumns} * kRows>
      cells{};  ///< of the picture, row by row: true where some station had a corner in the cell
  /// In which directions the scope's tip pointed over the board, in eighths of a turn from the board's x axis towards
  /// its y axis: first at tilts of 8 to 25 degrees against the board's normal, then at larger ones.
  std::array<bool, std::size_t{2} * kSectors> tilts{};
  std::array<bool, kTurns> turns{};        ///< about the scope's own axis, in quarters against the board
  double nearest_mm = 0, furthest_mm = 0;  ///< to the board's plane, along the scope's axis; 0 without stations
  int stations = 0;

  [[nodiscard]] int cells_covered() const;
  [[nodiscard]] int tilts_covered() const;
  [[nodiscard]] int turns_covered() const;
  /// 2 where the furthest is a quarter further than the nearest, else 1; 0 without stations.
  [[nodiscard]] int distances_covered() const;
  double share = 0;  ///< the mean of the four counts' shares, in [0, 1]
};
Coverage coverage_of(std::span<const Station> stations, int width_px, int height_px);
/// "picture 14 of 20 cells, tilts 9 of 16, turns 2 of 4, distances 1 of 2".
std::string coverage_line(const Coverage& coverage);

struct NextPose {
  Transform<Camera, Marker> camera_from_marker;
  /// What to do, from where the scope is now; where that is not known, from straight before the board, its x axis to
  /// the right. Empty: no pose shows enough of the board, which is to be brought into the picture first.
  std::optional<ScopeMove> move;
  bool from_straight = false;  ///< where the scope is now is not known
  /// The part by which one more station there is expected to shrink the hand-eye's error, in [0, 1]. 0 without a move.
  double gain = 0;
};

/// The pose that would teach most of the hand-eye, of a grid of poses about the board: tilts of 0, 18 and 36 degrees in
/// eight directions, eight turns, three distances about those of the stations so far, the board in the middle of the
/// picture or towards a corner. The poses are compared by the error to expect of the hand-eye afterwards
/// (StationInformation: A-optimal, a rotation counted at the working distance). Of the poses nearly as good as the
/// best, the one nearest to the scope is taken. Directions within 15 degrees of a station's are left out while there
/// are others, because a tracker repeats its error there. A pose must show at least as much of the board as the station
/// that saw least of it; all of the board where there are no stations. board_extent_mm: from the board's first point to
/// its last, along its x and y; its frame begins at the first. now: where the scope is. Poses that are not finite are
/// passed over.
NextPose next_best_pose(std::span<const Station> stations, const CameraModel& camera,
                        const Eigen::Vector3d& board_extent_mm, const std::optional<Transform<Camera, Marker>>& now,
                        const StationNoise& noise = {});

}  // namespace birdseye::calibration
