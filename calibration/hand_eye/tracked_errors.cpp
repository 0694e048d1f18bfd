#include "calibration/hand_eye/tracked_errors.hpp"

#include <cmath>
#include <limits>

#include "calibration/hand_eye/view_pose.hpp"

namespace birdseye::calibration {

TrackedErrors tracked_errors(const PreparedStation& p, const ChainState& state) {
  TrackedErrors out;
  const auto pose = tracked_view(p.corners.chain, state);
  if (p.corners.corners.empty()) {
    out.squares_mm = (pose.translation() - p.summed.camera_from_marker.translation()).squaredNorm();
    out.count = 1;
  }
  for (const SeenCorners& corners : p.corners.corners) {
    for (std::size_t i = 0; i < corners.view->points_px.size(); ++i) {
      const Eigen::Vector3d point = corners.lens_from_camera * (pose * corners.view->points_in_marker_mm[i]);
      const auto pixel = project(*corners.camera, point);
      const auto ray = unproject(*corners.camera, corners.view->points_px[i]);
      out.count += 1;
      if (!pixel || !ray) {
        out.squares_px = out.squares_mm = std::numeric_limits<double>::infinity();
        continue;
      }
      out.squares_px += (*pixel - corners.view->points_px[i]).squaredNorm();
      out.squares_mm += (point.head<2>() - ray->head<2>() * point.z()).squaredNorm();
      if (&corners != p.corners.corners.data()) continue;
      out.seen.push_back(corners.view->points_px[i]);
      out.predicted.push_back(*pixel);
    }
  }
  out.px = std::sqrt(out.squares_px / out.count);
  out.mm = std::sqrt(out.squares_mm / out.count);
  return out;
}

double tracked_score(const HandEyeStations& stations, const std::optional<CameraModel>& camera,
                     const ChainState& state) {
  double squares = 0, count = 0;
  for (const PreparedStation& p : stations.used) {
    const auto pose = tracked_view(p.corners.chain, state);
    if (p.corners.corners.empty()) {
      squares += (pose.translation() - p.summed.camera_from_marker.translation()).squaredNorm();
      count += 1;
      continue;
    }
    const auto sum = sum_corners(p.corners.corners, pose, 1);
    const double behind_px = camera->width_px + camera->height_px;
    const auto corners =
        static_cast<double>(stations.views[p.index].points_px.size() + stations.right_views[p.index].points_px.size());
    squares += sum ? sum->squares : behind_px * behind_px * corners;
    count += corners;
  }
  return std::sqrt(squares / count);
}

}  // namespace birdseye::calibration
