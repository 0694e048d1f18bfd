#include "host/registration/geometry/patch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace birdseye::host {

namespace {

/// Between samples, in pixels of a picture of 768; so large a patch in every picture, that it is as large on the organ.
constexpr double kBetween_px = 1.5;
constexpr int kMiddle = kPatchSide / 2;
constexpr double kLeastCommon = 0.85;  ///< share of a patch that both pictures show

/// From a patch's middle to sample i of it.
Eigen::Vector2d offset(int i) {
  const int column = i % kPatchSide, row = i / kPatchSide;
  return {column - kMiddle, row - kMiddle};
}

/// Bilinear; x and y at least 0 and less than one from the last. NaN beside a pixel that does not count.
float sample(const cv::Mat& picture, float x, float y) {
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const float s = x - static_cast<float>(column), t = y - static_cast<float>(row);
  const float* const upper = picture.ptr<float>(row) + column;
  const float* const lower = picture.ptr<float>(row + 1) + column;
  const float a = upper[0] + s * (upper[1] - upper[0]), b = lower[0] + s * (lower[1] - lower[0]);
  return a + t * (b - a);
}

double between_px(const PinholeView& view) {
  return kBetween_px * view.width_px / kReferenceWidth_px;
}

/// So far from a picture's border every patch's middle is.
int margin_px(const PinholeView& view) {
  constexpr int kBorder_px = 4;
  return static_cast<int>(std::ceil(between_px(view) * kMiddle)) + kBorder_px;
}

}  // namespace

std::vector<GridPixel> patch_grid(const std::vector<PinholeView>& views, double every_px) {
  std::vector<GridPixel> out;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const PinholeView& view = views[v];
    const int step_px = std::max(1, static_cast<int>(std::lround(every_px * view.width_px / kReferenceWidth_px)));
    for (int y = margin_px(view); y < view.height_px - margin_px(view); y += step_px) {
      for (int x = margin_px(view); x < view.width_px - margin_px(view); x += step_px) out.push_back({v, x, y});
    }
  }
  return out;
}

std::optional<Patch> patch_at(const PinholeView& view, const DepthMap& depths, const SeenSurface& surface, int x_px,
                              int y_px) {
  if (view.usable.at<std::uint8_t>(y_px, x_px) == 0) return std::nullopt;
  if (!std::isfinite(depths.at(x_px, y_px))) return std::nullopt;
  Patch patch{};
  patch.view = &view;
  patch.x_px = x_px;
  patch.y_px = y_px;
  patch.between_px = between_px(view);
  patch.ray = view.ray(x_px, y_px);
  const auto met = surface.meet(view.eye_in_patient_mm, patch.ray);
  if (!met || met->distance_mm != 0) return std::nullopt;
  patch.depth_mm = met->depth_mm;
  patch.place_mm = view.eye_in_patient_mm + met->depth_mm * patch.ray;
  patch.normal = surface.normal(patch.place_mm);
  if (-patch.normal.dot(patch.ray.normalized()) < kPatchFacing) return std::nullopt;
  int count = 0;
  for (int i = 0; i < kPatchSamples; ++i) {
    const auto sx = static_cast<float>(x_px + patch.between_px * offset(i).x());
    const auto sy = static_cast<float>(y_px + patch.between_px * offset(i).y());
    const float value = sample(view.texture, sx, sy);
    patch.texture[static_cast<std::size_t>(i)] = value;
    if (!std::isnan(value)) ++count;
  }
  if (count < kLeastCommon * kPatchSamples) return std::nullopt;
  return patch;
}

PatchSeenBy::PatchSeenBy(const Patch& patch, const PinholeView& other) : patch_(patch), other_(other) {
  const PinholeView& view = *patch.view;
  for (int i = 0; i < kPatchSamples; ++i) {
    x_px_[i] = static_cast<float>(patch.x_px + patch.between_px * offset(i).x());
    y_px_[i] = static_cast<float>(patch.y_px + patch.between_px * offset(i).y());
  }
  Eigen::Matrix3d ray_of;  // of (x, y, 1)
  ray_of << 1 / view.fx_px, 0, -view.cx_px / view.fx_px, 0, 1 / view.fy_px, -view.cy_px / view.fy_px, 0, 0, 1;
  ray_of = view.camera_from_patient.rotation().transpose() * ray_of;
  Eigen::Matrix3d lens;
  lens << other.fx_px, 0, other.cx_px, 0, other.fy_px, other.cy_px, 0, 0, 1;
  far_ = lens * other.camera_from_patient.rotation() * ray_of;
  const Eigen::Vector3d apart = lens * (other.camera_from_patient * view.eye_in_patient_mm);
  per_inverse_depth_ = apart * (patch.normal.transpose() * ray_of) / patch.normal.dot(patch.ray);
}

float PatchSeenBy::correlation(double depth_mm, const Eigen::Vector2d& beside_px) const {
  // Pixels of the view to pixels of the other by the plane n . (p - eye) = n . ray * depth.
  Eigen::Matrix3d by_plane = far_ + per_inverse_depth_ / depth_mm;
  by_plane.topRows<2>() += beside_px * by_plane.row(2);
  const Eigen::Matrix3f h = by_plane.cast<float>();
  const Samples per_w = (h(2, 0) * x_px_ + h(2, 1) * y_px_ + h(2, 2)).inverse();
  const Samples u = (h(0, 0) * x_px_ + h(0, 1) * y_px_ + h(0, 2)) * per_w;
  const Samples v = (h(1, 0) * x_px_ + h(1, 1) * y_px_ + h(1, 2)) * per_w;
  const auto most_x = static_cast<float>(other_.width_px - 2), most_y = static_cast<float>(other_.height_px - 2);
  Samples b;
  for (Eigen::Index i = 0; i < b.size(); ++i) {
    const bool within = u[i] >= 0 && v[i] >= 0 && u[i] < most_x && v[i] < most_y;
    b[i] = within ? sample(other_.texture, u[i], v[i]) : std::numeric_limits<float>::quiet_NaN();
  }
  const Eigen::Map<const Samples> texture(patch_.texture.data());
  const Samples both = texture + b;
  const auto untold = both.isNaN();
  const Samples a = untold.select(0.0F, texture);
  b = untold.select(0.0F, b);
  const auto count = static_cast<float>(kPatchSamples - untold.count());
  if (count < static_cast<float>(kLeastCommon) * kPatchSamples) return std::numeric_limits<float>::quiet_NaN();
  const float sum_a = a.sum(), sum_b = b.sum();
  // Both are about 0 in the mean, so that little is lost by taking the means off at the end.
  const float aa = a.square().sum() - sum_a * sum_a / count, bb = b.square().sum() - sum_b * sum_b / count;
  constexpr float kFlat = 1e-6F;
  if (aa < kFlat * count || bb < kFlat * count) return 0;
  return ((a * b).sum() - sum_a * sum_b / count) / std::sqrt(aa * bb);
}

}  // namespace birdseye::host
