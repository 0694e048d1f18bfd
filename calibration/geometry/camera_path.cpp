#include "calibration/geometry/camera_path.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace birdseye {

Transform<Camera, Patient> camera_along(std::span<const Transform<Camera, Patient>> keys, double t) {
  assert(!keys.empty());
  t = std::clamp(t, 0.0, static_cast<double>(keys.size() - 1));
  const auto i = static_cast<std::size_t>(t);
  const double u = t - static_cast<double>(i);
  if (u == 0) return keys[i];
  const auto centre = [&](std::size_t key) { return Eigen::Vector3d(keys[key].inverse().translation()); };
  const Eigen::Vector3d p1 = centre(i), p2 = centre(i + 1);
  const Eigen::Vector3d p0 = i > 0 ? centre(i - 1) : Eigen::Vector3d(2 * p1 - p2);
  const Eigen::Vector3d p3 = i + 2 < keys.size() ? centre(i + 2) : Eigen::Vector3d(2 * p2 - p1);
  const Eigen::Vector3d c =
      p1 + 0.5 * u * ((p2 - p0) + u * ((2 * p0 - 5 * p1 + 4 * p2 - p3) + u * (3 * p1 - p0 - 3 * p2 + p3)));
  const Eigen::Quaterniond camera_from_patient = keys[i].quaternion().slerp(u, keys[i + 1].quaternion());
  return {camera_from_patient, Eigen::Vector3d(-(camera_from_patient * c))};
}

}  // namespace birdseye
