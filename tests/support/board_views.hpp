#pragma once

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "calibration/detect/pattern_view.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::testing {

/// A flat board of columns x rows points, pitch_mm apart, held before a camera by an unsteady hand.
struct BoardScene {
  int columns = 12, rows = 9;
  double pitch_mm = 5;
  double tilt_rad = 0.6;  ///< about either axis of the picture, at most
  double distance_mm = 100, distance_spread_mm = 25;
  double noise_px = 0.2;

  [[nodiscard]] std::vector<Eigen::Vector3d> points_mm() const {
    std::vector<Eigen::Vector3d> out;
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) out.emplace_back(pitch_mm * column, pitch_mm * row, 0);
    }
    return out;
  }

  [[nodiscard]] std::vector<Transform<Camera, Marker>> poses(int count, unsigned seed) const {
    std::mt19937 rng(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::vector<Transform<Camera, Marker>> out;
    const Eigen::Vector3d middle(0.5 * pitch_mm * (columns - 1), 0.5 * pitch_mm * (rows - 1), 0);
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d tilt(uniform(rng), uniform(rng), 0);
      const Eigen::Matrix3d turn = rotation_exp(tilt_rad * tilt) * rotation_exp({0, 0, 2 * uniform(rng)});
      const double z = distance_mm + distance_spread_mm * uniform(rng);
      const Eigen::Vector3d at(0.3 * z * uniform(rng), 0.2 * z * uniform(rng), z);
      out.emplace_back(turn, Eigen::Vector3d(at - turn * middle));
    }
    return out;
  }

  /// What the camera sees of the board there; points outside the picture are left out.
  [[nodiscard]] calibration::PatternView view(const CameraModel& camera, const Transform<Camera, Marker>& pose,
                                              std::mt19937& rng, const std::string& name) const {
    std::normal_distribution<double> normal(0, noise_px);
    calibration::PatternView out;
    out.name = name;
    const auto board = points_mm();
    for (std::size_t i = 0; i < board.size(); ++i) {
      const Eigen::Vector2d noise = noise_px > 0 ? Eigen::Vector2d(normal(rng), normal(rng)) : Eigen::Vector2d(0, 0);
      const auto pixel = project(camera, pose * board[i]);
      if (!pixel || !inside(camera, *pixel + noise)) continue;
      out.ids.push_back(static_cast<int>(i));
      out.points_in_marker_mm.push_back(board[i]);
      out.points_px.emplace_back(*pixel + noise);
    }
    return out;
  }

  [[nodiscard]] std::vector<calibration::PatternView> views(const CameraModel& camera, int count, unsigned seed) const {
    std::mt19937 rng(seed + 1000);
    std::vector<calibration::PatternView> out;
    for (const auto& pose : poses(count, seed))
      out.push_back(view(camera, pose, rng, "view" + std::to_string(out.size())));
    return out;
  }

  static bool inside(const CameraModel& camera, const Eigen::Vector2d& p) {
    return p.x() >= 0 && p.y() >= 0 && p.x() <= camera.width_px - 1 && p.y() <= camera.height_px - 1;
  }
};

/// A laparoscope in HD whose lens has one term of distortion, or as many as given.
inline CameraModel hd_lens(double k1 = -0.22, double k2 = 0, double p1 = 0, double p2 = 0, double k3 = 0) {
  CameraModel c;
  c.width_px = 1920;
  c.height_px = 1080;
  c.fx_px = 1450;
  c.fy_px = 1442;
  c.cx_px = 981;
  c.cy_px = 528;
  c.k1 = k1;
  c.k2 = k2;
  c.p1 = p1;
  c.p2 = p2;
  c.k3 = k3;
  return c;
}

/// The points of one view as a folder of text files holds them: calib.ids.0.txt and so on.
inline calibration::PatternView read_view(const std::filesystem::path& folder, int number) {
  const auto open = [&](const char* what) {
    return std::ifstream(folder / ("calib." + std::string(what) + "." + std::to_string(number) + ".txt"));
  };
  std::ifstream ids = open("ids"), object = open("object_points"), image = open("image_points");
  calibration::PatternView out;
  out.name = std::to_string(number);
  int id = 0;
  while (ids >> id) {
    Eigen::Vector3d p;
    Eigen::Vector2d q;
    object >> p.x() >> p.y() >> p.z();
    image >> q.x() >> q.y();
    out.ids.push_back(id);
    out.points_in_marker_mm.push_back(p);
    out.points_px.push_back(q);
  }
  return out;
}

}  // namespace birdseye::testing
