#include "calibration/camera/camera_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "calibration/base/student95.hpp"
#include "calibration/base/units.hpp"
#include "calibration/camera/board_flatness.hpp"
#include "calibration/camera/camera_bundle.hpp"
#include "calibration/camera/camera_figures.hpp"
#include "calibration/camera/camera_focus.hpp"
#include "calibration/camera/camera_outliers.hpp"
#include "calibration/camera/camera_views.hpp"
#include "calibration/geometry/linear_algebra.hpp"

namespace birdseye::calibration {

namespace {

/// One lens model fitted to all views, and what it is worth on views it has not seen.
struct ModelFit {
  LensModel model = LensModel::pinhole;
  CameraModel camera;
  std::vector<BundleView> views;
  std::vector<double> convergence_px;
  double rms_px = 0;
  std::vector<double> held_out_squares_px2;  ///< per view, summed over its points
  double held_out_px = 0, held_out_angle_rad = 0;
  std::size_t groups = 0;  ///< in which the views were held out
  CameraVector sigma_between_views = CameraVector::Zero();
  bool usable = true;  ///< a lens was found, and it does not fold inside the picture
  bool folds = false;
};

std::size_t used_points(std::span<const BundleView> views) {
  std::size_t count = 0;
  for (const BundleView& view : views)
    count += static_cast<std::size_t>(std::count(view.weights.begin(), view.weights.end(), 1.0));
  return count;
}

double squares_of(const CameraModel& camera, const BundleView& view) {
  const auto residuals = residuals_px(camera, view);
  double sum = 0;
  for (std::size_t i = 0; i < residuals.size(); ++i) sum += view.weights[i] * residuals[i].squaredNorm();
  return sum;
}

/// The same as an angle, which times a distance is an error in space.
double angle_squares_of(const CameraModel& camera, const BundleView& view) {
  const auto residuals = residuals_px(camera, view);
  const Eigen::Array2d focal(camera.fx_px, camera.fy_px);
  double sum = 0;
  for (std::size_t i = 0; i < residuals.size(); ++i)
    sum += view.weights[i] * (residuals[i].array() / focal).matrix().squaredNorm();
  return sum;
}

/// Fits the lens without each group of views in turn, and that group's views with it.
void hold_out(ModelFit& fit, int folds) {
  const std::size_t groups = std::min(fit.views.size(), static_cast<std::size_t>(std::max(2, folds)));
  fit.groups = groups;
  std::vector<CameraVector> lenses;
  double squares = 0, angle_squares = 0;
  fit.held_out_squares_px2.assign(fit.views.size(), 0);
  for (std::size_t group = 0; group < groups; ++group) {
    std::vector<BundleView> others;
    for (std::size_t v = 0; v < fit.views.size(); ++v) {
      if (v % groups != group) others.push_back(fit.views[v]);
    }
    CameraModel camera = fit.camera;
    refine_bundle(camera, others, solved_by(fit.model), {.most_steps = 12, .tolerance = 1e-9});
    lenses.push_back(parameters_of(camera));
    for (std::size_t v = group; v < fit.views.size(); v += groups) {
      BundleView view = fit.views[v];
      view.camera_from_marker = fit_pose(camera, view);
      fit.held_out_squares_px2[v] = squares_of(camera, view);
      squares += fit.held_out_squares_px2[v];
      angle_squares += angle_squares_of(camera, view);
    }
  }
  const auto points = static_cast<double>(used_points(fit.views));
  fit.held_out_px = std::sqrt(squares / points);
  fit.held_out_angle_rad = std::sqrt(angle_squares / points);
  const auto n = static_cast<double>(groups);
  CameraVector mean = CameraVector::Zero(), variance = CameraVector::Zero();
  for (const CameraVector& lens : lenses) mean += lens / n;
  // Grouped jackknife (B. Efron and C. Stein, 1981).
  for (const CameraVector& lens : lenses) variance += (n - 1) / n * (lens - mean).cwiseAbs2();
  fit.sigma_between_views = variance.cwiseSqrt();
}

std::vector<ModelFit> fit_models(const CameraModel& start, const SoundViews& sound, int folds) {
  std::vector<ModelFit> fits;
  CameraModel camera = start;
  camera.k1 = camera.k2 = camera.p1 = camera.p2 = camera.k3 = 0;
  std::vector<BundleView> views;
  for (const SoundView& view : sound.views) views.push_back(view.bundle);
  for (const LensModel model : kLensModels) {
    // Each model starts where the one before it, which it contains, has ended.
    BundleSummary summary = refine_bundle(camera, views, solved_by(model), {.most_steps = 100});
    ModelFit& fit = fits.emplace_back();
    fit.model = model;
    fit.camera = camera;
    fit.views = views;
    fit.convergence_px = std::move(summary.rms_px);
    double squares = 0;
    for (const BundleView& view : views) squares += squares_of(camera, view);
    fit.rms_px = std::sqrt(squares / static_cast<double>(used_points(views)));
    fit.usable = static_cast<bool>(check(camera));
    if (!fit.usable) {
      fit.held_out_px = fit.held_out_angle_rad = std::numeric_limits<double>::quiet_NaN();
      fit.held_out_squares_px2.assign(views.size(), fit.held_out_px);
      continue;
    }
    fit.folds = folds_inside(camera);
    hold_out(fit, folds);
    fit.usable = !fit.folds && std::isfinite(fit.held_out_px);
  }
  return fits;
}

/// By how many of its own standard errors the other model does better, view by view, on what it was not shown.
double gain_of(const ModelFit& other, const ModelFit& fit) {
  const auto n = static_cast<double>(fit.views.size());
  double mean = 0, squares = 0;
  for (std::size_t v = 0; v < fit.views.size(); ++v) {
    const double gain = fit.held_out_squares_px2[v] - other.held_out_squares_px2[v];
    mean += gain / n;
    squares += gain * gain / n;
  }
  const double error = std::sqrt(std::max(0.0, squares - mean * mean) / (n - 1));
  return error > 0 ? mean / error : (mean > 0 ? std::numeric_limits<double>::infinity() : 0);
}

/// So near to the best that the simpler model is taken: what it may leave out is then in the sigma.
bool as_good(const ModelFit& fit, const ModelFit& best) {
  constexpr double kStandardErrors = 1.0 / 3;
  constexpr double kTooLittle = 1.001;  // a held-out error 0.1 % larger hides a bend of a twentieth of the noise
  return fit.held_out_px <= kTooLittle * best.held_out_px || gain_of(best, fit) <= kStandardErrors;
}

/// So far from the best that chance is no excuse. A gain that is sure and next to nothing refutes nobody.
bool refuted(const ModelFit& fit, const ModelFit& best) {
  return !as_good(fit, best) && gain_of(best, fit) > 1;
}

/// The model with the least held-out error.
const ModelFit& best_of(const std::vector<ModelFit>& fits) {
  const ModelFit *best = nullptr, *best_folding = nullptr;
  for (const ModelFit& fit : fits) {
    const ModelFit*& rival = fit.usable ? best : best_folding;
    if (std::isfinite(fit.held_out_px) && (rival == nullptr || fit.held_out_px < rival->held_out_px)) rival = &fit;
  }
  // A lens that fits far better and folds is what the views say; one that does not fold and does not fit helps nobody.
  constexpr double kFarBetter = 0.5;
  if (best == nullptr || (best_folding != nullptr && best_folding->held_out_px < kFarBetter * best->held_out_px))
    return best_folding != nullptr ? *best_folding : fits.front();
  return *best;
}

const ModelFit& choose(const std::vector<ModelFit>& fits, const ModelFit& best, std::optional<LensModel> asked) {
  return *std::ranges::find_if(fits, [&](const ModelFit& fit) {
    if (asked) return fit.model == *asked;
    return &fit == &best || (fit.usable && best.usable && as_good(fit, best));
  });
}

/// Whether anybody need flatten the board: good ones are bent by some hundredths of a millimetre.
bool matters(const BoardSag& sag, const CameraModel& camera) {
  constexpr double kFlatEnough_mm = 0.05;
  const Eigen::Array4d change = sag.lens_change.head<4>().array().abs();
  return sag.sag_mm > kFlatEnough_mm ||
         std::max(change[0] / camera.fx_px, change[1] / camera.fy_px) > camera_limits::kFocalSigmaPass ||
         std::max(change[2], change[3]) > camera_limits::kCentreSigmaPass * camera.width_px;
}

/// From the noise's: each parameter's deviation at least what the views among themselves say, their correlations kept;
/// and the distances to the other models' lenses and to that of a bent board.
void add_doubt(const std::vector<ModelFit>& fits, const ModelFit& best, const ModelFit& fit, CameraCalibration& out) {
  // Few groups tell a spread badly.
  const double few = few_groups_factor(fit.groups);
  CameraVector wider = CameraVector::Ones();
  const CameraVector noise = out.noise_sigma();
  for (Eigen::Index i = 0; i < wider.size(); ++i) {
    if (noise[i] > 0) wider[i] = std::max(1.0, few * fit.sigma_between_views[i] / noise[i]);
  }
  out.covariance = wider.asDiagonal() * out.noise_covariance * wider.asDiagonal();
  CameraMatrix between = CameraMatrix::Zero();
  double count = 0;
  for (const ModelFit& other : fits) {
    const bool believed = &other == &best || (other.usable && best.usable && !refuted(other, best));
    if (!believed) continue;
    const CameraVector apart = parameters_of(other.camera) - parameters_of(fit.camera);
    between += apart * apart.transpose();
    count += 1;
  }
  between /= count;
  constexpr double kTold = 2;  // standard errors
  const auto sag = find_board_sag(fit.camera, fit.model, fit.views);
  if (sag && sag->standard_errors > kTold) {
    if (matters(*sag, fit.camera)) out.board_sag_mm = sag->sag_mm;
    between += sag->lens_change * sag->lens_change.transpose();
  }
  out.covariance += between;
  out.sigma_between_models = between.diagonal().cwiseSqrt();
  if (&fit != &best && refuted(fit, best)) out.refuted_by = best.model;
}

void add_covariance(const ModelFit& fit, CameraCalibration& out) {
  std::vector<int> solved;
  for (int i = 0; i < CameraModel::kParameters; ++i) {
    if (solved_by(fit.model)[static_cast<std::size_t>(i)]) solved.push_back(i);
  }
  const auto points = static_cast<double>(used_points(fit.views));
  const double freedom = 2 * points - static_cast<double>(solved.size() + 6 * fit.views.size());
  out.noise_sigma_px = fit.rms_px * std::sqrt(points / std::max(freedom, 1.0));
  const Eigen::MatrixXd information = lens_information(fit.camera, fit.views)(solved, solved);
  // In units in which each parameter alone is known equally well, so that the eigenvalues can be compared.
  const Eigen::VectorXd unit = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const auto eigen = symmetric_eigen(Eigen::MatrixXd(unit.asDiagonal() * information * unit.asDiagonal()));
  constexpr double kOpen = 1e-11;
  if (!(eigen.values[0] > kOpen)) {
    Eigen::Index worst = 0;
    eigen.vectors.col(0).cwiseAbs().maxCoeff(&worst);
    out.undetermined = kCameraParameterNames[static_cast<std::size_t>(solved[static_cast<std::size_t>(worst)])];
  }
  const Eigen::VectorXd inverse = eigen.values.cwiseMax(kOpen).cwiseInverse();
  const Eigen::MatrixXd root = unit.asDiagonal() * eigen.vectors;
  out.noise_covariance(solved, solved) =
      out.noise_sigma_px * out.noise_sigma_px * (root * inverse.asDiagonal() * root.transpose());
}

CameraCalibration put_together(const ModelFit& fit, const SoundViews& sound,
                               const CameraCalibrationSettings& settings) {
  CameraCalibration out;
  out.camera = fit.camera;
  out.model = fit.model;
  out.pixel_aspect = settings.pixel_aspect;
  out.folds = fit.folds;
  out.sigma_between_views = fit.sigma_between_views;
  out.rms_px = fit.rms_px;
  out.held_out_px = fit.held_out_px;
  out.convergence_px = fit.convergence_px;
  out.rejected = sound.rejected;
  std::sort(out.rejected.begin(), out.rejected.end(),
            [](const RejectedView& a, const RejectedView& b) { return a.index < b.index; });
  std::vector<std::size_t> order(sound.views.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return sound.views[a].index < sound.views[b].index; });
  std::vector<BundleView> in_order;
  for (const std::size_t v : order) {
    add_view(sound.views[v], fit.camera, fit.views[v], fit.held_out_squares_px2[v], out);
    in_order.push_back(fit.views[v]);
  }
  out.focal_halves = focal_halves_of(fit.camera, fit.model, in_order);
  add_covariance(fit, out);
  add_geometry(out);
  add_regions(settings.columns, settings.rows, out);
  out.held_out_mm = fit.held_out_angle_rad * out.mean_distance_mm;
  return out;
}

}  // namespace

Result<CameraCalibration> calibrate_camera(std::span<const PatternView> views, int width_px, int height_px,
                                           const CameraCalibrationSettings& settings) {
  auto sound = sort_out(views, width_px, height_px);
  if (!sound) return sound.error();
  if (sound->views.size() < kLeastViews) return too_few_views(sound->views.size(), sound->rejected);
  auto start = start_camera(*sound, width_px, height_px, settings.pixel_aspect, settings.robust);
  if (!start) return start.error();
  if (settings.robust) {
    if (const auto left_out = leave_out_outliers(*start, *sound); !left_out) return left_out.error();
  }
  const std::vector<ModelFit> fits = fit_models(*start, *sound, settings.folds);
  const ModelFit& best = best_of(fits);
  const ModelFit& chosen = choose(fits, best, settings.model);
  if (const auto checked = check(chosen.camera); !checked)
    return Error{Errc::degenerate,
                 "the views do not determine a camera: take more, with the board tilted to all sides"};
  CameraCalibration out = put_together(chosen, *sound, settings);
  add_doubt(fits, best, chosen, out);
  for (const ModelFit& fit : fits) {
    out.models.push_back(
        {fit.model, fit.camera, fit.rms_px, fit.held_out_px, fit.held_out_angle_rad * out.mean_distance_mm, fit.folds});
  }
  return out;
}

}  // namespace birdseye::calibration
