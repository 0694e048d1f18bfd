#include "host/volume/marker_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <unsupported/Eigen/NonLinearOptimization>
#include <unsupported/Eigen/NumericalDiff>
#include <utility>
#include <vector>

namespace birdseye::host {

namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

// Of a CT's point spread, sigma: a first guess, and what scanners and simulators have.
constexpr double kBlur_mm = 0.5, kLeastBlur_mm = 0.1, kMostBlur_mm = 1.2;
constexpr double kPartOf_mm = 1;  // voxels are divided until their parts are no longer than this
constexpr std::size_t kMostSources = 1200;
constexpr double kWorthFitting = 0.2;  // of the voxels explained by the first guess

/// The voxels round a marker, and what each would hold without it.
struct Neighbourhood {
  std::vector<Vector3d> from_start_mm;
  VectorXd hu, surroundings_hu;
};

/// Parts of a voxel, as offsets from its centre in the patient frame, and the variance of a place in one along an axis.
struct Parts {
  std::vector<Vector3d> from_centre_mm;
  double variance_mm2 = 0;
};
Parts parts_of(const Volume& ct) {
  std::array<int, 3> count{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    count[axis] = std::clamp(static_cast<int>(std::ceil(ct.spacing_mm[static_cast<int>(axis)] / kPartOf_mm)), 1, 6);
  Parts parts;
  for (int axis = 0; axis < 3; ++axis)
    parts.variance_mm2 += std::pow(ct.spacing_mm[axis] / count[static_cast<std::size_t>(axis)], 2) / 12 / 3;
  for (int k = 0; k < count[2]; ++k) {
    for (int j = 0; j < count[1]; ++j) {
      for (int i = 0; i < count[0]; ++i) {
        const Vector3d in_voxel((i + 0.5) / count[0] - 0.5, (j + 0.5) / count[1] - 0.5, (k + 0.5) / count[2] - 0.5);
        parts.from_centre_mm.emplace_back(ct.patient_from_voxel.linear() * in_voxel);
      }
    }
  }
  return parts;
}

/// off_mm: how far off the start may be.
Neighbourhood neighbourhood(const Volume& ct, const MarkerShape& shape, const Vector3d& start_mm, const Vector3d& axis,
                            double off_mm) {
  // Clear of the marker, its blur, and voxels that it fills in part, which are as long as the direction has them; then
  // a rim of two voxels to learn the surroundings from.
  const Eigen::Matrix3d towards_axes =
      (ct.patient_from_voxel.linear() * ct.spacing_mm.cwiseInverse().asDiagonal()).transpose();
  const auto clear_mm = [&](const Vector3d& p) {
    return 0.5 * (towards_axes * p.normalized()).cwiseAbs().dot(ct.spacing_mm) + kBlur_mm + off_mm;
  };
  const double rim_mm = std::max(2 * ct.spacing_mm.maxCoeff(), 1.5);
  const double reach_mm = shape.widest_mm() / 2 + ct.spacing_mm.norm() + kBlur_mm + off_mm + rim_mm;
  const Vector3d middle = ct.patient_from_voxel.inverse() * start_mm;
  const Eigen::Array3d reach = reach_mm / ct.spacing_mm.array();
  const Eigen::Array3i low = (middle.array() - reach).ceil().cast<int>().max(0);
  const Eigen::Array3i high =
      (middle.array() + reach).floor().cast<int>().min(Eigen::Array3i(ct.size[0], ct.size[1], ct.size[2]) - 1);
  std::vector<std::pair<Vector3d, double>> marker, clear;
  for (int k = low.z(); k <= high.z(); ++k) {
    for (int j = low.y(); j <= high.y(); ++j) {
      for (int i = low.x(); i <= high.x(); ++i) {
        const Vector3d p = ct.patient_from_voxel * Vector3d(i, j, k) - start_mm;
        const double outside = shape.outside_mm(p, axis);
        if (outside <= clear_mm(p) + rim_mm) (outside > clear_mm(p) ? clear : marker).emplace_back(p, ct.at(i, j, k));
      }
    }
  }
  Neighbourhood out;
  if (clear.empty()) return out;
  out.hu.resize(static_cast<Eigen::Index>(marker.size()));
  out.surroundings_hu.resize(out.hu.size());
  const std::size_t stride = clear.size() / kMostSources + 1;
  // A few voxels at a time, whose sums the processor makes side by side.
  constexpr std::size_t kAtOnce = 4;
  using Lanes = Eigen::Array<double, static_cast<int>(kAtOnce), 1>;
  for (std::size_t first = 0; first < marker.size(); first += kAtOnce) {
    const std::size_t count = std::min(kAtOnce, marker.size() - first);
    std::array<Lanes, 3> place;
    for (std::size_t n = 0; n < kAtOnce; ++n) {
      const Vector3d& p = marker[first + std::min(n, count - 1)].first;
      for (std::size_t a = 0; a < 3; ++a) place[a][static_cast<Eigen::Index>(n)] = p[static_cast<Eigen::Index>(a)];
    }
    Lanes sums = Lanes::Zero(), weights = Lanes::Zero();
    for (std::size_t c = 0; c < clear.size(); c += stride) {
      const Vector3d& from = clear[c].first;
      const Lanes squared_mm2 =
          (place[0] - from.x()).square() + (place[1] - from.y()).square() + (place[2] - from.z()).square();
      // Steep: what is next to a voxel counts, not what there is most of.
      const Lanes weight = squared_mm2.square().inverse();
      sums += weight * clear[c].second;
      weights += weight;
    }
    for (std::size_t n = 0; n < count; ++n) {
      const auto lane = static_cast<Eigen::Index>(n), at = static_cast<Eigen::Index>(first + n);
      out.from_start_mm.push_back(marker[first + n].first);
      out.hu[at] = marker[first + n].second;
      out.surroundings_hu[at] = sums[lane] / weights[lane];
    }
  }
  return out;
}

/// Residuals in HU for Eigen's Levenberg-Marquardt. Parameters: centre from the start (mm), log scale, blur, and
/// for shapes with an axis its tilt in two directions.
struct Model {
  using Scalar = double;
  using InputType = VectorXd;
  using ValueType = VectorXd;
  using JacobianType = Eigen::MatrixXd;
  enum { InputsAtCompileTime = Eigen::Dynamic, ValuesAtCompileTime = Eigen::Dynamic };

  const MarkerShape& shape;
  const Neighbourhood& around;
  const Parts& parts;
  Vector3d axis, tilt_a, tilt_b;

  [[nodiscard]] int inputs() const { return shape.kind == MarkerKind::ball ? 5 : 7; }
  [[nodiscard]] int values() const { return static_cast<int>(around.hu.size()); }
  [[nodiscard]] Vector3d axis_of(const VectorXd& x) const {
    return inputs() == 5 ? axis : Vector3d((axis + x[5] * tilt_a + x[6] * tilt_b).normalized());
  }

  static double blur_mm(const VectorXd& x) {
    return kLeastBlur_mm + (kMostBlur_mm - kLeastBlur_mm) / (1 + std::exp(-x[4]));
  }
  static double of_blur(double blur_mm) {
    return -std::log((kMostBlur_mm - kLeastBlur_mm) / (blur_mm - kLeastBlur_mm) - 1);
  }

  /// The share of each voxel that the shape fills.
  [[nodiscard]] VectorXd filled(const VectorXd& x) const {
    const Vector3d turned = axis_of(x);
    const double scale = std::exp(x[3]);
    const double blur = std::sqrt(blur_mm(x) * blur_mm(x) + parts.variance_mm2);
    const double part_mm = parts.from_centre_mm.back().norm();  // the farthest of them
    VectorXd share(values());
    for (int i = 0; i < values(); ++i) {
      const Vector3d p = around.from_start_mm[static_cast<std::size_t>(i)] - x.head<3>();
      const double at_centre = scale * shape.outside_mm(p / scale, turned);
      if (std::abs(at_centre) > 4 * blur + part_mm) {
        share[i] = at_centre < 0 ? 1 : 0;
        continue;
      }
      double sum = 0;
      for (const Vector3d& part : parts.from_centre_mm)
        sum += 0.5 * std::erfc(scale * shape.outside_mm((p + part) / scale, turned) / (blur * std::sqrt(2.0)));
      share[i] = sum / static_cast<double>(parts.from_centre_mm.size());
    }
    return share;
  }
  /// The density that fits best: residual = hu - (1 - share) surroundings - share density, linear in it.
  [[nodiscard]] double density_hu(const VectorXd& share) const {
    const VectorXd without = around.hu - (1 - share.array()).matrix().cwiseProduct(around.surroundings_hu);
    return without.dot(share) / std::max(share.squaredNorm(), 1e-9);
  }
  int operator()(const VectorXd& x, VectorXd& residuals) const {
    const VectorXd share = filled(x);
    residuals =
        around.hu - (1 - share.array()).matrix().cwiseProduct(around.surroundings_hu) - density_hu(share) * share;
    return 0;
  }
};

/// Of the centre per axis, from what the fit leaves. Voxels that the marker fills in part err together, so that far
/// fewer are independent than there are; and no fit is better than kLeast_voxels.
double centre_sigma_mm(const Model& model, const VectorXd& x, const VectorXd& residuals, const Volume& ct) {
  constexpr double kTogether = 4, kLeast_voxels = 0.03;
  Eigen::MatrixXd jacobian(model.values(), model.inputs());
  Eigen::NumericalDiff<Model> differences(model, 1e-8);
  differences.df(x, jacobian);
  const Eigen::MatrixXd normal = jacobian.transpose() * jacobian;
  const Eigen::MatrixXd covariance = normal.completeOrthogonalDecomposition().pseudoInverse() *
                                     (residuals.squaredNorm() / std::max(1, model.values() - model.inputs()));
  return std::hypot(std::sqrt(kTogether * covariance.topLeftCorner<3, 3>().trace() / 3),
                    kLeast_voxels * ct.spacing_mm.maxCoeff());
}

/// One round: from is what is known so far. Without moving it only weighs how well that explains the voxels.
std::optional<MarkerFit> fit_once(const Volume& ct, const MarkerShape& shape, const MarkerFit& from, double off_mm,
                                  bool moving) {
  const Neighbourhood around = neighbourhood(ct, shape, from.centre_in_patient_mm, from.axis, off_mm);
  constexpr std::size_t kFewestVoxels = 12;
  if (around.from_start_mm.size() < kFewestVoxels) return std::nullopt;
  const Parts parts = parts_of(ct);
  const Vector3d tilt_a = from.axis.unitOrthogonal();
  const Model model{shape, around, parts, from.axis, tilt_a, from.axis.cross(tilt_a)};
  VectorXd x = VectorXd::Zero(model.inputs());
  x[3] = std::log(from.scale);
  x[4] = Model::of_blur(kBlur_mm);
  if (moving) {
    Eigen::NumericalDiff<Model> differences(model, 1e-8);  // steps of 1e-4
    Eigen::LevenbergMarquardt<Eigen::NumericalDiff<Model>> solver(differences);
    solver.parameters.maxfev = 200;
    solver.parameters.xtol = 1e-4;
    solver.parameters.ftol = 1e-6;
    solver.minimize(x);
    if (!x.allFinite()) return std::nullopt;
  }
  const VectorXd share = model.filled(x);
  VectorXd residuals;
  model(x, residuals);
  MarkerFit fit;
  fit.kind = shape.kind;
  fit.sigma_mm = moving ? centre_sigma_mm(model, x, residuals, ct) : 0;
  fit.centre_in_patient_mm = from.centre_in_patient_mm + x.head<3>();
  fit.axis = model.axis_of(x);
  fit.scale = std::exp(x[3]);
  fit.diameter_mm = fit.scale * shape.diameter_mm;
  fit.hu = model.density_hu(share);
  fit.contrast_hu = fit.hu - share.dot(around.surroundings_hu) / std::max(share.sum(), 1e-9);
  fit.explained = 1 - residuals.squaredNorm() / std::max((around.hu - around.surroundings_hu).squaredNorm(), 1e-9);
  return fit;
}

}  // namespace

std::optional<MarkerFit> fit_marker(const Volume& ct, const MarkerShape& shape, const Vector3d& centre_in_patient_mm,
                                    const Eigen::Matrix3d& directions) {
  std::optional<MarkerFit> best;
  for (int i = 0; i < (shape.kind == MarkerKind::ball ? 1 : 3); ++i) {
    MarkerFit guess;
    guess.centre_in_patient_mm = centre_in_patient_mm;
    guess.axis = directions.col(i);
    guess.scale = 1;
    const auto weighed = fit_once(ct, shape, guess, ct.spacing_mm.mean(), false);
    if (weighed && (!best || weighed->explained > best->explained)) best = weighed;
  }
  if (!best || best->explained < kWorthFitting) return best;
  const auto rough = fit_once(ct, shape, *best, ct.spacing_mm.mean(), true);
  if (!rough || (rough->centre_in_patient_mm - centre_in_patient_mm).norm() > shape.widest_mm() / 2)
    return std::nullopt;
  // Once more from where that ended, with the surroundings from closer by.
  return fit_once(ct, shape, *rough, 0, true);
}

bool has_size(const Volume& ct, const MarkerShape& shape, const MarkerFit& fit) {
  constexpr double kLeastContrast_hu = 80;
  // A size that is off by a tenth, and by a part of a voxel, is the threshold's and the scanner's doing.
  const double slack = 0.12 + 0.3 * ct.spacing_mm.minCoeff() / shape.diameter_mm;
  return fit.contrast_hu >= kLeastContrast_hu && std::abs(std::log(fit.scale)) < slack;
}

}  // namespace birdseye::host
