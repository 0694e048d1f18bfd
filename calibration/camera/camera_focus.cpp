#include "calibration/camera/camera_focus.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calibration/base/student95.hpp"
#include "calibration/geometry/camera_parameters.hpp"
#include "calibration/geometry/linear_algebra.hpp"

namespace birdseye::calibration {

namespace {

constexpr std::size_t kLeastInHalf = 5;
constexpr std::size_t kFocusGroups = 5;  // in which a half's views are left out

struct FocalLength {
  double px = 0, variance_px2 = 0;
};

double focal_of(const CameraModel& camera) {
  return (camera.fx_px + camera.fy_px) / 2;
}

/// The variance of the mean of fx and fy, px^2, if the residuals are independent.
double focal_variance_px2(const CameraModel& camera, LensModel model, const std::vector<BundleView>& views) {
  std::vector<int> solved;
  for (int i = 0; i < CameraModel::kParameters; ++i) {
    if (solved_by(model)[static_cast<std::size_t>(i)]) solved.push_back(i);
  }
  double squares_px2 = 0, points = 0;
  for (const BundleView& view : views) {
    const auto residuals = residuals_px(camera, view);
    for (std::size_t i = 0; i < residuals.size(); ++i) {
      squares_px2 += view.weights[i] * residuals[i].squaredNorm();
      points += view.weights[i];
    }
  }
  const double freedom = 2 * points - static_cast<double>(solved.size() + 6 * views.size());
  const Eigen::MatrixXd inverse = inverse_information(Eigen::MatrixXd(lens_information(camera, views)(solved, solved)));
  // fx and fy are the first two of each model.
  return squares_px2 / std::max(1.0, freedom) * inverse.topLeftCorner<2, 2>().sum() / 4;
}

/// Of some views alone; its variance the larger of what residuals and views say (grouped jackknife: B. Efron and C.
/// Stein, 1981). Groups are of neighbours, which are alike: those of a part of the picture or of a tilt, at which a
/// lens model that does not hold has its own focal length.
FocalLength focal_alone(CameraModel camera, LensModel model, std::vector<BundleView> views) {
  constexpr BundleSettings kSteps{.most_steps = 30, .tolerance = 1e-9};
  refine_bundle(camera, views, solved_by(model), kSteps);
  double sum = 0, squares = 0;
  for (std::size_t group = 0; group < kFocusGroups; ++group) {
    std::vector<BundleView> others;
    for (std::size_t v = 0; v < views.size(); ++v) {
      if (v * kFocusGroups / views.size() != group) others.push_back(views[v]);
    }
    CameraModel without = camera;
    refine_bundle(without, others, solved_by(model), kSteps);
    const double change_px = focal_of(without) - focal_of(camera);
    sum += change_px;
    squares += change_px * change_px;
  }
  constexpr double n = kFocusGroups;
  const double few = few_groups_factor(kFocusGroups);
  const double between_px2 = few * few * (n - 1) / n * (squares - sum * sum / n);
  return {focal_of(camera), std::max(focal_variance_px2(camera, model, views), between_px2)};
}

}  // namespace

std::optional<FocalHalves> focal_halves_of(const CameraModel& camera, LensModel model,
                                           std::span<const BundleView> views) {
  const std::size_t half = views.size() / 2;
  if (half < kLeastInHalf) return std::nullopt;
  const FocalLength first = focal_alone(camera, model, {views.begin(), views.begin() + static_cast<long>(half)});
  const FocalLength second = focal_alone(camera, model, {views.begin() + static_cast<long>(half), views.end()});
  return FocalHalves{first.px, second.px, std::sqrt(first.variance_px2 + second.variance_px2)};
}

}  // namespace birdseye::calibration
