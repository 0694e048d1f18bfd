#include "calibration/camera/camera_outliers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/base/median.hpp"

namespace birdseye::calibration {

namespace {

constexpr double kMedianOfRayleigh = 1.17741;  // median length of a two-dimensional normal error of sigma 1
// No detector is finer; below it, rounding would be taken for scatter.
constexpr double kFinest = 0.01 / 1920;  // of the width

/// Scatter per axis, from the median length of residuals: of all points, and of each view's.
struct Scatter {
  double all_px = 0;
  std::vector<double> view_px;
  std::vector<std::vector<double>> lengths_px;  ///< per view and point
};

Scatter scatter_of(const CameraModel& camera, const std::vector<SoundView>& views) {
  const double finest_px = kFinest * camera.width_px;
  Scatter out;
  std::vector<double> all;
  for (const SoundView& view : views) {
    std::vector<double>& lengths = out.lengths_px.emplace_back();
    for (const Eigen::Vector2d& r : residuals_px(camera, view.bundle)) lengths.push_back(r.norm());
    out.view_px.push_back(std::max(finest_px, median_of(lengths) / kMedianOfRayleigh));
    all.insert(all.end(), lengths.begin(), lengths.end());
  }
  out.all_px = std::max(finest_px, median_of(all) / kMedianOfRayleigh);
  return out;
}

/// Refines with weights that follow the residuals until their scatter stays.
void fit_robustly(CameraModel& camera, std::vector<SoundView>& views, LensModel model) {
  constexpr double kCauchy = 2.385;  // 95 % efficient on normal errors
  constexpr int kRounds = 12;
  Scatter scatter = scatter_of(camera, views);
  for (int round = 0; round < kRounds; ++round) {
    std::vector<BundleView> bundle;
    for (std::size_t v = 0; v < views.size(); ++v) {
      for (std::size_t i = 0; i < views[v].ids.size(); ++i) {
        const double ratio = scatter.lengths_px[v][i] / (kCauchy * scatter.all_px);
        views[v].bundle.weights[i] = 1 / (1 + ratio * ratio);
      }
      bundle.push_back(views[v].bundle);
    }
    refine_bundle(camera, bundle, solved_by(model), {.most_steps = 8, .tolerance = 1e-6});
    for (std::size_t v = 0; v < views.size(); ++v) views[v].bundle.camera_from_marker = bundle[v].camera_from_marker;
    const double before_px = scatter.all_px;
    scatter = scatter_of(camera, views);
    if (std::abs(scatter.all_px - before_px) < 1e-3 * before_px) return;
  }
}

/// Moves views that do not fit to the rejected ones; false if there are none.
bool reject_views(const CameraModel& camera, SoundViews& sound) {
  constexpr double kTimes = 5;  // a view that is merely blurred scatters two or three times as much as the others
  constexpr double kFinest_px = 0.05;  // of what a detector leaves: no picture has less, and drawn ones may have none
  const Scatter scatter = scatter_of(camera, sound.views);
  const double usual_px = std::max(median_of(scatter.view_px), kFinest_px);
  std::vector<SoundView> kept;
  for (std::size_t v = 0; v < sound.views.size(); ++v) {
    if (scatter.view_px[v] > kTimes * usual_px) {
      sound.rejected.push_back({sound.views[v].index, sound.views[v].name,
                                fmt::format("its points are off by {:.2f} px, {:.1f} times as much as those of the "
                                            "other views: blurred, bent or misnumbered",
                                            scatter.view_px[v] * kMedianOfRayleigh, scatter.view_px[v] / usual_px)});
    } else {
      kept.push_back(std::move(sound.views[v]));
    }
  }
  const bool any = kept.size() < sound.views.size();
  sound.views = std::move(kept);
  return any;
}

/// Weights of 0 and 1 by the residuals as they stand; whether any changed.
bool mark_outliers(const CameraModel& camera, std::vector<SoundView>& views) {
  const Scatter scatter = scatter_of(camera, views);
  double points = 0;
  for (const SoundView& view : views) points += static_cast<double>(view.ids.size());
  // P(length > k sigma) = exp(-k^2 / 2) in two dimensions.
  constexpr double kByChance = 0.01;
  const double times = std::sqrt(2 * std::log(points / kByChance));
  bool changed = false;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const double limit_px = times * std::max(scatter.all_px, scatter.view_px[v]);
    for (std::size_t i = 0; i < views[v].ids.size(); ++i) {
      const double weight = scatter.lengths_px[v][i] > limit_px ? 0 : 1;
      changed = changed || weight != views[v].bundle.weights[i];
      views[v].bundle.weights[i] = weight;
    }
  }
  return changed;
}

void fit_plainly(CameraModel& camera, std::vector<SoundView>& views, LensModel model) {
  std::vector<BundleView> bundle;
  bundle.reserve(views.size());
  for (const SoundView& view : views) bundle.push_back(view.bundle);
  refine_bundle(camera, bundle, solved_by(model), {.most_steps = 20, .tolerance = 1e-10});
  for (std::size_t v = 0; v < views.size(); ++v) views[v].bundle.camera_from_marker = bundle[v].camera_from_marker;
}

}  // namespace

Result<void> leave_out_outliers(CameraModel& camera, SoundViews& sound) {
  // One term first: from a start that knows no distortion, the higher ones would take what is the focal length's.
  fit_robustly(camera, sound.views, LensModel::radial1);
  fit_robustly(camera, sound.views, LensModel::radial3_tangential2);
  while (reject_views(camera, sound)) {
    if (sound.views.size() < kLeastViews) return too_few_views(sound.views.size(), sound.rejected);
    fit_robustly(camera, sound.views, LensModel::radial3_tangential2);
  }
  constexpr int kRounds = 5;
  for (int round = 0; round < kRounds && mark_outliers(camera, sound.views); ++round)
    fit_plainly(camera, sound.views, LensModel::radial3_tangential2);
  return check(camera);
}

}  // namespace birdseye::calibration
