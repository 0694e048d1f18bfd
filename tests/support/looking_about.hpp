#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "device/wire/messages.hpp"
#include "host/overlay/scope_setup.hpp"
#include "tests/support/textured_scene.hpp"

namespace birdseye::testing {

inline const CameraModel kLookingScope{192, 144, 150, 150, 95.5, 71.5};

inline host::ScopeSetup scope_with(const Transform<Camera, Sensor>& camera_from_sensor) {
  host::ScopeFigures figures;
  figures.camera_rms_px = 0.2;
  figures.held_out_px = 1;
  figures.held_out_mm = 0.7;
  return *host::ScopeSetup::of_values(kLookingScope, std::nullopt, camera_from_sensor, figures);
}

/// marks: by so much black squares differ, as by the markers of a ChArUco board.
inline std::vector<std::uint8_t> picture_of_board(const Transform<Camera, Patient>& view, int marks) {
  constexpr double kSquare_mm = 5;
  constexpr int kSamples = 2;  // of a pixel, along each side: an edge is soft
  const Transform<Patient, Camera> back = view.inverse();
  std::vector<std::uint8_t> rgb;
  for (int y = 0; y < kLookingScope.height_px; ++y)
    for (int x = 0; x < kLookingScope.width_px; ++x) {
      int grey = 0;
      for (int i = 0; i < kSamples * kSamples; ++i) {
        const Eigen::Vector2d at_px(x + (i % kSamples + 0.5) / kSamples - 0.5,
                                    y + (i / kSamples + 0.5) / kSamples - 0.5);
        const Eigen::Vector3d ray = back.rotation() * *unproject(kLookingScope, at_px), eye_mm = back.translation();
        const Eigen::Vector3d place_mm = eye_mm - ray * (eye_mm.z() / ray.z());
        const auto square = [](double mm) { return static_cast<int>(std::floor(mm / kSquare_mm)); };
        const int column = square(place_mm.x()), row = square(place_mm.y());
        grey += ((column + row) & 1) != 0 ? 200 : 40 + marks * (((column * 7 + row * 13) % 5 + 5) % 5);
      }
      rgb.insert(rgb.end(), 3, static_cast<std::uint8_t>(grey / (kSamples * kSamples)));
    }
  return rgb;
}

/// A scope that looks about over a scene, and who watches its video: by take() of a time and a pose, and of a frame and
/// the scope.
template <class Watcher>
struct LookingAbout {
  Transform<Camera, Sensor> camera_from_sensor{rotation_exp(Eigen::Vector3d(0.2, -0.1, 0.4)),
                                               Eigen::Vector3d(5, -3, -300)};
  Transform<Camera, Sensor> told = camera_from_sensor;  ///< as the window has it
  double haste = 1;                                     ///< 0: it rests
  std::optional<double> swings_s{};                     ///< each second so long, and then it rests; empty: it sways
  double late_s = 0;                                    ///< of the pictures' stamps
  bool latency_measured = true;
  std::function<Eigen::Vector3d(double t_s)> scene_moves{};  ///< against the tracker
  Eigen::Vector3d bumped_mm{0, 0, 0};                        ///< by which the tracker has every pose elsewhere
  double bumped_from_s = -1, bumped_over_s = 0.1;            ///< from then on, and after so long by all of it
  Transform<Camera, Camera> turned{};  ///< of the scope in its holder: pictures turn, the sensor does not
  CameraModel lens = kLookingScope;    ///< as it is; the scope's record has kLookingScope
  bool pattern = true;
  int marks = 0;       ///< and by so much the black ones differ
  bool board = false;  ///< squares of 5 mm are what it looks about over
  Watcher motion;

  void look(double from_s, double seconds) {
    TexturedScene scene(Eigen::Vector3d(0, 0, 0));
    std::mt19937 random(3);
    std::normal_distribution<double> position_mm(0, 0.3), angle_rad(0, 0.1 * kRadPerDeg);
    const auto normal3 = [&](auto& of) { return Eigen::Vector3d(of(random), of(random), of(random)); };
    const host::ScopeSetup scope = scope_with(told);
    for (int i = 0; i < static_cast<int>(seconds * 100); ++i) {
      const double t_s = from_s + i * 0.01, second = std::floor(t_s);
      // From rest to rest.
      const double swung = swings_s ? std::min(1.0, (t_s - second) / *swings_s) : 0;
      const double s = haste * (swings_s ? second + swung * swung * (3 - 2 * swung) : t_s);
      const Eigen::Matrix3d turn =
          rotation_exp(Eigen::Vector3d(0.3 * std::sin(1.4 * s), 0.35 * std::sin(1.1 * s + 1), 0.4 * std::sin(0.8 * s)));
      const Transform<Camera, Patient> view(
          turn, Eigen::Vector3d(8 * std::sin(s), 9 * std::cos(1.3 * s), 100 + 15 * std::sin(0.9 * s)));
      const auto sensor = view.inverse() * camera_from_sensor;
      const double bumped = std::clamp((t_s - bumped_from_s) / bumped_over_s, 0.0, 1.0);
      const Transform<Tracker, Sensor> noisy(
          rotation_exp(normal3(angle_rad)) * sensor.rotation(),
          Eigen::Vector3d(sensor.translation() + bumped * bumped_mm + normal3(position_mm)));
      motion.take(DeviceTime{std::llround(t_s * 1e9)}, noisy);
      if (i % 4 != 0) continue;
      wire::VideoFrame frame;
      frame.info.acquired = {std::llround((t_s + late_s) * 1e9)};
      if (latency_measured) frame.info.latency = Duration{0};
      frame.info.pose.kind = PoseKind::exact;
      frame.info.pose.tracker_from_sensor = noisy;
      frame.width_px = kLookingScope.width_px;
      frame.height_px = kLookingScope.height_px;
      const Eigen::Vector3d moved = scene_moves ? scene_moves(t_s) : Eigen::Vector3d::Zero().eval();
      const auto seen = turned * view * Transform<Patient, Patient>(Eigen::Matrix3d::Identity(), moved);
      auto rgb = board ? picture_of_board(seen, marks) : scene.picture(lens, seen);
      if (!pattern) std::fill(rgb.begin(), rgb.end(), std::uint8_t{90});
      frame.rgb = std::make_shared<std::vector<std::uint8_t>>(std::move(rgb));
      motion.take(frame, scope);
    }
  }
};

}  // namespace birdseye::testing
