#include "hw-sim/world/board_stations.hpp"

#include <cmath>
#include <numbers>

#include "calibration/base/units.hpp"
#include "hw-sim/base/hashed.hpp"
#include "hw-sim/camera/look_at.hpp"

namespace birdseye::hw_sim {

using Eigen::Vector3d;

std::vector<Transform<Marker, Camera>> stations_over(const Chessboard& board, const CameraModel& lens,
                                                     std::uint64_t seed, std::size_t so_many) {
  std::vector<Transform<Marker, Camera>> stations;
  std::uint64_t draw = 0;
  const auto uniform = [&](double low, double high) { return low + (high - low) * hashed_uniform(seed + 41, draw++); };
  const double width = (board.columns - 1) * board.square_mm;
  const double height = (board.rows - 1) * board.square_mm;
  while (stations.size() < so_many) {
    // Tilts spread round the clock and rolls to both sides: rotations about many axes are what hand-eye needs.
    const double azimuth = 2 * std::numbers::pi * uniform(0, 1);
    const double tilt = uniform(12, 32) * kRadPerDeg;
    const double distance = uniform(74, 112);
    const double roll = uniform(-65, 65) * kRadPerDeg;
    const Vector3d target(0.5 * width + uniform(-14, 14), 0.5 * height + uniform(-10, 10), 0);
    const Vector3d eye = target - distance * Vector3d(std::sin(tilt) * std::cos(azimuth),
                                                      std::sin(tilt) * std::sin(azimuth), std::cos(tilt));
    const Transform<Marker, Camera> pose = look_at<Marker>(eye, target, Vector3d(0, 1, 0), roll);
    // All inner corners, and the squares round them, must lie in the round field.
    bool whole = true;
    const double s = board.square_mm;
    for (const double x : {-s, width + s}) {
      for (const double y : {-s, height + s}) {
        const auto seen = project(lens, pose.inverse() * Vector3d(x, y, 0));
        const Eigen::Vector2d centre(lens.cx_px, lens.cy_px);
        whole = whole && seen && (*seen - centre).norm() < 0.49 * lens.width_px && seen->x() > 6 && seen->y() > 6 &&
                seen->x() < lens.width_px - 7 && seen->y() < lens.height_px - 7;
      }
    }
    if (whole) stations.push_back(pose);
    if (draw > 100'000) break;
  }
  return stations;
}

}  // namespace birdseye::hw_sim
