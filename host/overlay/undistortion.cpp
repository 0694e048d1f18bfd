#include "host/overlay/undistortion.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "calibration/geometry/lens_fold.hpp"

namespace birdseye::host {

namespace {

/// The tangents that the camera's pixels reach: at its rim, and within it too, for a fold may keep the rim dark.
struct Reach {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;
};

Reach reach_of(const CameraModel& camera) {
  constexpr int kGrid_px = 8;
  Reach reach;
  for (int y = 0; y < camera.height_px; ++y) {
    const bool rim_row = y == 0 || y == camera.height_px - 1;
    for (int x = 0; x < camera.width_px; ++x) {
      const bool rim = rim_row || x == 0 || x == camera.width_px - 1;
      if (!rim && (x % kGrid_px != 0 || y % kGrid_px != 0)) continue;
      const auto ray = unproject(camera, Eigen::Vector2d(x, y));
      if (!ray || ray->head<2>().norm() > kWidestTangent) continue;
      reach.low = reach.low.cwiseMin(ray->head<2>());
      reach.high = reach.high.cwiseMax(ray->head<2>());
    }
  }
  return reach;
}

cv::Size size_of(const CameraModel& camera) {
  return {camera.width_px, camera.height_px};
}

std::size_t pixels_of(const CameraModel& camera) {
  return static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
}

}  // namespace

CameraModel pinhole_for(const CameraModel& camera, Kept kept) {
  CameraModel pinhole = camera;
  pinhole.k1 = pinhole.k2 = pinhole.p1 = pinhole.p2 = pinhole.k3 = 0;
  if (kept == Kept::centre_scale) return pinhole;
  const Reach reach = reach_of(camera);
  const Eigen::Vector2d focal(camera.fx_px, camera.fy_px);
  const Eigen::Vector2d last(camera.width_px - 1, camera.height_px - 1);
  const Eigen::Vector2d wide = focal.cwiseProduct(reach.high - reach.low);
  if (!(wide.minCoeff() > 0)) return pinhole;  // a picture of one column, or a lens that sees nothing
  const double scale = last.cwiseQuotient(wide).minCoeff();
  const Eigen::Vector2d centre = 0.5 * (last - scale * focal.cwiseProduct(reach.low + reach.high));
  pinhole.fx_px = scale * focal.x();
  pinhole.fy_px = scale * focal.y();
  pinhole.cx_px = centre.x();
  pinhole.cy_px = centre.y();
  return pinhole;
}

FrameUndistorter::FrameUndistorter(const CameraModel& from, const CameraModel& to) : from_(from), to_(to) {
  const double fold = fold_radius(from);
  const bool pinhole = to.k1 == 0 && to.k2 == 0 && to.p1 == 0 && to.p2 == 0 && to.k3 == 0;
  const auto ray_of = [&](double x, double y) -> std::optional<Eigen::Vector3d> {
    if (!pinhole) return unproject(to, Eigen::Vector2d(x, y));
    return Eigen::Vector3d((x - to.cx_px) / to.fx_px, (y - to.cy_px) / to.fy_px, 1);  // a tenth of the time
  };
  constexpr float kNowhere = -8;  // far enough outside that no neighbour of it is a pixel
  const auto furthest = static_cast<double>(std::numeric_limits<std::int16_t>::max() - 1);
  cv::Mat at(size_of(to), CV_32FC2);
  tbb::parallel_for(0, to.height_px, [&](int y) {
    auto* const row = at.ptr<cv::Vec2f>(y);
    for (int x = 0; x < to.width_px; ++x) {
      row[x] = {kNowhere, kNowhere};
      const auto ray = ray_of(x, y);
      if (!ray) continue;
      const auto pixel = project_seen(from, *ray, fold);
      if (!pixel || !(pixel->cwiseAbs().maxCoeff() < furthest)) continue;
      row[x] = {static_cast<float>(pixel->x()), static_cast<float>(pixel->y())};
    }
  });
  where_.resize(2 * pixels_of(to));
  fraction_.resize(pixels_of(to));
  cv::Mat where(size_of(to), CV_16SC2, where_.data()), fraction(size_of(to), CV_16UC1, fraction_.data());
  cv::convertMaps(at, cv::noArray(), where, fraction, CV_16SC2);
}

std::vector<std::uint8_t> FrameUndistorter::apply(std::span<const std::uint8_t> pixels) const {
  std::vector<std::uint8_t> out(3 * pixels_of(to_));
  if (pixels.size() != 3 * pixels_of(from_)) return out;
  const cv::Mat source(size_of(from_), CV_8UC3, const_cast<std::uint8_t*>(pixels.data()));
  const cv::Mat where(size_of(to_), CV_16SC2, const_cast<std::int16_t*>(where_.data()));
  const cv::Mat fraction(size_of(to_), CV_16UC1, const_cast<std::uint16_t*>(fraction_.data()));
  cv::Mat straight(size_of(to_), CV_8UC3, out.data());
  cv::remap(source, straight, where, fraction, cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  return out;
}

void FrameUndistorter::hide_unseen(ImageRgba& overlay) const {
  if (overlay.rgba.size() != 4 * pixels_of(to_)) return;
  for (std::size_t i = 0; i < pixels_of(to_); ++i) {
    const int x = where_[2 * i], y = where_[2 * i + 1];
    const bool seen = x >= 0 && y >= 0 && x < from_.width_px && y < from_.height_px;
    if (!seen) std::fill_n(&overlay.rgba[4 * i], 4, std::uint8_t{0});
  }
}

}  // namespace birdseye::host
