#include "calibration/camera/camera_figures.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/base/units.hpp"

namespace birdseye::calibration {

const char* name_of(LensModel model) {
  switch (model) {
    case LensModel::pinhole:
      return "pinhole";
    case LensModel::radial1:
      return "radial1";
    case LensModel::radial2:
      return "radial2";
    case LensModel::radial2_tangential2:
      return "radial2_tangential2";
    case LensModel::radial3_tangential2:
      return "radial3_tangential2";
  }
  return "";
}

std::optional<LensModel> lens_model_of(std::string_view name) {
  for (const LensModel model : kLensModels) {
    if (name == name_of(model)) return model;
  }
  return std::nullopt;
}

std::array<bool, CameraModel::kParameters> solved_by(LensModel model) {
  const bool tangential = model >= LensModel::radial2_tangential2;
  return {true,
          true,
          true,
          true,
          model >= LensModel::radial1,
          model >= LensModel::radial2,
          tangential,
          tangential,
          model >= LensModel::radial3_tangential2};
}

bool folds_inside(const CameraModel& camera) {
  // A fold closes in on the axis along every ray, so that the rim is where it shows first.
  const auto no_ray = [&](double u, double v) { return !unproject(camera, Eigen::Vector2d(u, v)); };
  const double right = camera.width_px - 0.5, bottom = camera.height_px - 0.5;
  constexpr int kSteps = 200;
  for (int i = 0; i <= kSteps; ++i) {
    const double u = -0.5 + (right + 0.5) * i / kSteps, v = -0.5 + (bottom + 0.5) * i / kSteps;
    if (no_ray(u, -0.5) || no_ray(u, bottom) || no_ray(-0.5, v) || no_ray(right, v)) return true;
  }
  return false;
}

void add_view(const SoundView& view, const CameraModel& camera, const BundleView& fitted, double held_out_squares_px2,
              CameraCalibration& out) {
  FittedView figures;
  figures.index = view.index;
  figures.name = view.name;
  figures.points = view.ids.size();
  const auto residuals = residuals_px(camera, fitted);
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();
  double squares = 0;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const bool outlier = fitted.weights[i] == 0;
    out.points.push_back({out.views.size(), view.ids[i], fitted.points_px[i], residuals[i], outlier});
    figures.outliers += outlier ? 1 : 0;
    squares += outlier ? 0 : residuals[i].squaredNorm();
    middle_mm += fitted.points_mm[i] / static_cast<double>(residuals.size());
  }
  const auto used = static_cast<double>(figures.points - figures.outliers);
  figures.rms_px = std::sqrt(squares / used);
  figures.held_out_px = std::sqrt(held_out_squares_px2 / used);
  figures.tilt_deg = std::acos(std::min(1.0, std::abs(fitted.camera_from_marker.rotation()(2, 2)))) * kDegPerRad;
  figures.distance_mm = (fitted.camera_from_marker * middle_mm).z();
  out.outliers += figures.outliers;
  out.camera_from_marker.push_back(fitted.camera_from_marker);
  out.views.push_back(std::move(figures));
}

void add_geometry(CameraCalibration& out) {
  out.least_distance_mm = HUGE_VAL;
  for (std::size_t a = 0; a < out.views.size(); ++a) {
    const double distance_mm = out.views[a].distance_mm;
    out.mean_distance_mm += distance_mm / static_cast<double>(out.views.size());
    out.least_distance_mm = std::min(out.least_distance_mm, distance_mm);
    out.largest_distance_mm = std::max(out.largest_distance_mm, distance_mm);
    for (std::size_t b = 0; b < a; ++b) {
      // The sign of a normal does not count: a board that is numbered from its other side lies in the same plane.
      const double cosine =
          std::abs(out.camera_from_marker[a].rotation().col(2).dot(out.camera_from_marker[b].rotation().col(2)));
      out.tilt_spread_deg = std::max(out.tilt_spread_deg, std::acos(std::min(cosine, 1.0)) * kDegPerRad);
    }
  }
}

void add_regions(int columns, int rows, CameraCalibration& out) {
  out.columns = std::max(1, columns);
  out.rows = std::max(1, rows);
  for (int row = 0; row < out.rows; ++row) {
    for (int column = 0; column < out.columns; ++column) out.regions.push_back({column, row, 0, 0, {0, 0}});
  }
  for (const FittedPoint& point : out.points) {
    if (point.outlier) continue;
    const int column = std::clamp(static_cast<int>((point.pixel_px.x() + 0.5) * out.columns / out.camera.width_px), 0,
                                  out.columns - 1);
    const int row =
        std::clamp(static_cast<int>((point.pixel_px.y() + 0.5) * out.rows / out.camera.height_px), 0, out.rows - 1);
    RegionResidual& region = out.regions[static_cast<std::size_t>(row) * static_cast<std::size_t>(out.columns) +
                                         static_cast<std::size_t>(column)];
    ++region.count;
    region.rms_px += point.residual_px.squaredNorm();
    region.mean_px += point.residual_px;
  }
  std::size_t covered = 0;
  for (RegionResidual& region : out.regions) {
    if (region.count == 0) continue;
    ++covered;
    const auto count = static_cast<double>(region.count);
    region.rms_px = std::sqrt(region.rms_px / count);
    region.mean_px /= count;
  }
  out.coverage = static_cast<double>(covered) / static_cast<double>(out.regions.size());
}

}  // namespace birdseye::calibration
