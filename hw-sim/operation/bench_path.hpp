#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "hw-sim/camera/laparoscope.hpp"

namespace birdseye::hw_sim {

/// The way of a scope over a board that it is calibrated by: from station to station, at rest at each, and round again.
class BenchPath {
 public:
  /// Error: the board does not fit into the lens's picture from as many stations.
  static Result<BenchPath> create(const Transform<Tracker, Marker>& tracker_from_marker, const CameraModel& lens,
                                  std::uint64_t seed);

  [[nodiscard]] Transform<Tracker, Camera> at(double at_s) const;
  [[nodiscard]] const Transform<Tracker, Marker>& tracker_from_marker() const { return tracker_from_marker_; }
  [[nodiscard]] static const Chessboard& board();
  /// Until it has been at all stations.
  [[nodiscard]] static double round_s();
  /// The board as a calibration is told of it.
  [[nodiscard]] static std::string spec();

 private:
  BenchPath() = default;
  Transform<Tracker, Marker> tracker_from_marker_;
  std::vector<Transform<Tracker, Camera>> stations_;
};

}  // namespace birdseye::hw_sim
