#pragma once

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <string>
#include <vector>

#include "calibration/base/units.hpp"
#include "tests/support/rendered_board.hpp"

namespace birdseye::testing {

/// A lens of the laparoscope's kind in small pictures, which are drawn quickly.
inline CameraModel small_lens(double longer = 1) {
  CameraModel camera;
  camera.width_px = 640;
  camera.height_px = 400;
  camera.fx_px = camera.fy_px = 427 * longer;
  camera.cx_px = 316;
  camera.cy_px = 203;
  camera.k1 = -0.4;
  camera.k2 = 0.12;
  return camera;
}

/// A scope over a board at rest, drawn: pictures and tracked poses as files, the truth beside them.
class DrawnScope {
 public:
  explicit DrawnScope(const std::filesystem::path& folder) : folder_(folder) {}

  /// Holds that determine hand-eye: tilted to all sides and turned, the board all in the picture.
  [[nodiscard]] std::vector<Transform<Camera, Marker>> views(int count) const {
    std::vector<Transform<Camera, Marker>> out;
    for (int i = 0; i < count; ++i) {
      const double round_deg = 137.5 * i;
      const Eigen::Vector3d middle(16 * std::cos(2.1 * i), 9 * std::sin(3.7 * i), 105 + 15 * std::sin(1.3 * i));
      out.push_back(held(pattern_, middle, 24 + 7 * (i % 3), round_deg, 65 * std::sin(2.3 * i)));
    }
    return out;
  }

  /// light: as of Shot; a board that is hardly lit is not found.
  void paint(const std::string& name, const BoardPainter& painter, const Transform<Camera, Marker>& view,
             double light = 200) {
    Shot shot;
    shot.seed = ++shots_;
    shot.dark = light / 5;
    shot.light = light;
    std::filesystem::create_directories((folder_ / name).parent_path());
    cv::imwrite((folder_ / name).string(), painter.paint(pattern_, view, shot));
  }

  /// Where the tracker, not quite, says that the sensor is.
  void write_pose(const std::string& name, const Transform<Camera, Marker>& view,
                  const Transform<Camera, Sensor>& camera_from_sensor) {
    constexpr double kTurn_deg = 0.03, kShift_mm = 0.1;
    const Transform<Tracker, Sensor> exact = tracker_from_marker_ * view.inverse() * camera_from_sensor;
    const Eigen::Matrix3d turned = rotation_exp(kTurn_deg * kRadPerDeg * normal3()) * exact.rotation();
    write_matrix(name,
                 Transform<Tracker, Sensor>(turned, Eigen::Vector3d(exact.translation() + kShift_mm * normal3())));
  }

  template <typename To, typename From>
  void write_matrix(const std::string& name, const Transform<To, From>& transform) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream file(folder_ / name);
    file.precision(12);
    file << transform.matrix() << '\n';
  }

  [[nodiscard]] const std::string& board() const { return pattern_.spec; }

 private:
  Eigen::Vector3d normal3() {
    const double x = normal_(rng_), y = normal_(rng_);
    return {x, y, normal_(rng_)};
  }

  std::filesystem::path folder_;
  calibration::Pattern pattern_ = *calibration::parse_pattern("chessboard:10x7:6mm");
  Transform<Tracker, Marker> tracker_from_marker_{rotation_exp({0.1, 0.1, 0.6}), {330, -150, 140}};
  std::mt19937 rng_{1};
  std::normal_distribution<double> normal_{0, 1};
  unsigned shots_ = 0;
};

}  // namespace birdseye::testing
