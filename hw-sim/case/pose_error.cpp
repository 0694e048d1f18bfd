#include "hw-sim/case/pose_error.hpp"

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "hw-sim/case/draw.hpp"

namespace birdseye::hw_sim {

using Eigen::Vector3d;

std::vector<Transform<Camera, Patient>> tracked_poses(const std::vector<Transform<Camera, Patient>>& truth,
                                                      const PoseError& error, std::uint64_t seed) {
  const Transform<Camera, Sensor> camera_from_sensor(Eigen::Matrix3d(Eigen::Matrix3d::Identity()),
                                                     Vector3d(0, 0, -280));
  Draw draw(seed + 92);
  const Vector3d turn = error.offset_deg * kRadPerDeg * draw.direction();
  const Transform<Sensor, Sensor> offset(rotation_exp(turn), error.offset_mm * draw.direction());
  std::vector<Transform<Camera, Patient>> out;
  for (const auto& camera_from_patient : truth) {
    const auto normal3 = [&] {
      const double x = draw.normal();
      const double y = draw.normal();
      return Vector3d(x, y, draw.normal());
    };
    const Vector3d turned = error.noise_deg * kRadPerDeg * normal3();
    const Transform<Sensor, Sensor> noise(rotation_exp(turned), error.noise_mm * normal3());
    out.push_back(camera_from_sensor * offset * noise * camera_from_sensor.inverse() * camera_from_patient);
  }
  return out;
}

}  // namespace birdseye::hw_sim
