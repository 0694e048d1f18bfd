#include "calibration/hand_eye/board_symmetry.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

/// How much turns of the sensor and of the camera between two stations differ, rad^2.
double mismatch(const SummedStation& a, const Eigen::Matrix3d& camera_from_marker_a, const SummedStation& b,
                const Eigen::Matrix3d& camera_from_marker_b) {
  const auto body_from_sensor = [](const SummedStation& s) {
    return Eigen::Matrix3d(s.chain.tracker_from_body.rotation().transpose() * s.chain.tracker_from_sensor.rotation());
  };
  const double tracked = rotation_angle_between(body_from_sensor(a), body_from_sensor(b));
  const double seen = rotation_angle_between(camera_from_marker_a.transpose(), camera_from_marker_b.transpose());
  return (tracked - seen) * (tracked - seen);
}

}  // namespace

Transform<Marker, Marker> BoardSymmetry::turned(int times) const {
  const Eigen::Matrix3d turn = rotation_exp(Eigen::Vector3d(0, 0, 2 * std::numbers::pi * times / fold));
  const Eigen::Vector3d centre(centre_mm.x(), centre_mm.y(), 0);
  return {turn, Eigen::Vector3d(centre - turn * centre)};
}

std::vector<int> resolve_symmetry(std::span<const SummedStation> stations, const BoardSymmetry& symmetry) {
  // One station after the other is turned as it fits those before it, then as it fits all others, until none changes.
  constexpr int kRounds = 10;
  std::vector<int> turns(stations.size(), 0);
  const auto rotation = [&](std::size_t i, int times) {
    return Eigen::Matrix3d(stations[i].camera_from_marker.rotation() * symmetry.turned(times).rotation());
  };
  bool changed = true;
  for (int round = 0; round < kRounds && changed; ++round) {
    changed = round == 0;
    for (std::size_t i = 1; i < stations.size(); ++i) {
      int best = 0;
      double least = std::numeric_limits<double>::infinity();
      for (int times = 0; times < symmetry.fold; ++times) {
        double sum = 0;
        for (std::size_t k = 0; k < (round == 0 ? i : stations.size()); ++k) {
          if (k != i) sum += mismatch(stations[i], rotation(i, times), stations[k], rotation(k, turns[k]));
        }
        if (sum >= least) continue;
        least = sum;
        best = times;
      }
      changed = changed || best != turns[i];
      turns[i] = best;
    }
  }
  return turns;
}

}  // namespace birdseye::calibration
