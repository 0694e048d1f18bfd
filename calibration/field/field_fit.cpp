#include "calibration/field/field_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/base/units.hpp"
#include "calibration/field/board_shape.hpp"
#include "calibration/field/field_fit_parts.hpp"
#include "calibration/field/field_levels.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/points/point_fit.hpp"
#include "calibration/points/point_shape.hpp"

namespace birdseye::calibration {

namespace {

using detail::FoldedNormals;
using detail::kFolds;
using detail::SmoothedBasis;
using Eigen::MatrixXd;
using Vectors = std::vector<Eigen::Vector3d>;

constexpr std::size_t kFewestSamples = 30;
constexpr double kLeastScale = 0.8, kMostScale = 1.25;
constexpr double kLeastSpreadRatio = 0.2;  // further from 1 than places that are missing, or wrong, have it
constexpr int kScreenings = 12;

struct MeasuredGrid {
  Vectors measured_mm;
  Vectors wanted_mm;  ///< the correction at each: true, in the tracker's frame, less measured
  std::vector<bool> used;
  std::vector<int> fold;
};

struct Rigid {
  Transform<Tracker, Marker> tracker_from_board;
  double scale = 1;
};

Result<Rigid> board_in_tracker(std::span<const FieldSample> samples, const std::vector<bool>& used) {
  Vectors to, from;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!used[i]) continue;
    to.push_back(samples[i].measured.translation());
    from.push_back(samples[i].true_mm);
  }
  const auto fit = detail::fit_rigid(to, from);
  if (!fit) return fit.error();
  Eigen::Vector3d from_mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : from) from_mean += p / static_cast<double>(from.size());
  const Eigen::Vector3d to_mean = fit->rotation * from_mean + fit->translation_mm;
  double along = 0, squares = 0;
  for (std::size_t i = 0; i < to.size(); ++i) {
    const Eigen::Vector3d arm = fit->rotation * (from[i] - from_mean);
    along += arm.dot(to[i] - to_mean);
    squares += arm.squaredNorm();
  }
  return Rigid{{fit->rotation, fit->translation_mm}, along / squares};
}

Result<void> align(std::span<const FieldSample> samples, MeasuredGrid& grid, FieldFit& fit) {
  const auto rigid = board_in_tracker(samples, grid.used);
  if (!rigid) return rigid.error();
  fit.tracker_from_board = rigid->tracker_from_board;
  fit.scale = rigid->scale;
  for (std::size_t i = 0; i < samples.size(); ++i)
    grid.wanted_mm[i] = rigid->tracker_from_board * samples[i].true_mm - grid.measured_mm[i];
  return {};
}

FoldedNormals normals_of(const SmoothedBasis& basis, const MeasuredGrid& grid, const Vectors& wanted) {
  FoldedNormals normals(basis.size(), 3);
  for (int fold = 0; fold < kFolds; ++fold) {
    std::vector<std::size_t> in;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      if (grid.used[i] && grid.fold[i] == fold) in.push_back(i);
    }
    MatrixXd rows(in.size(), basis.size()), values(in.size(), 3);
    for (std::size_t k = 0; k < in.size(); ++k) {
      rows.row(static_cast<Eigen::Index>(k)) = basis.row(grid.measured_mm[in[k]]);
      values.row(static_cast<Eigen::Index>(k)) = wanted[in[k]].transpose();
    }
    normals.add(fold, rows, values);
  }
  normals.scale_penalty(basis.penalty);
  return normals;
}

struct HeldOutErrors {
  Vectors errors;                ///< corrected less true, of all samples, by fits that were not shown their folds
  std::vector<double> variance;  ///< of the prediction there, for noise of variance 1
};

/// Where the fit without a sample's fold is extrapolated: its prediction is less sure than one measurement. Nowhere, if
/// that were so of half of all samples: then they are too few for the map, which has to show.
std::vector<bool> extrapolated(const HeldOutErrors& held, const MeasuredGrid& grid) {
  std::vector<bool> out;
  for (const double variance : held.variance) out.push_back(variance > 1);
  std::size_t used = 0, beyond = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    used += grid.used[i] ? 1 : 0;
    beyond += grid.used[i] && out[i] ? 1 : 0;
  }
  if (2 * beyond >= used) out.assign(out.size(), false);
  return out;
}

HeldOutErrors held_out(const SmoothedBasis& basis, const FoldedNormals& normals, const MeasuredGrid& grid,
                       const Vectors& wanted, double smoothing) {
  HeldOutErrors out{Vectors(wanted.size()), std::vector<double>(wanted.size())};
  for (int fold = 0; fold < kFolds; ++fold) {
    if (std::find(grid.fold.begin(), grid.fold.end(), fold) == grid.fold.end()) continue;
    const auto solution = normals.solve(smoothing, fold);
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      if (grid.fold[i] != fold) continue;
      const Eigen::RowVectorXd row = basis.row(grid.measured_mm[i]);
      out.errors[i] = (row * solution.parameters).transpose() - wanted[i];
      out.variance[i] = row * solution.inverse * row.transpose();
    }
  }
  return out;
}

FieldCandidate best_smoothing(const SmoothedBasis& basis, const MeasuredGrid& grid) {
  const FoldedNormals normals = normals_of(basis, grid, grid.wanted_mm);
  FieldCandidate best{basis.functions.basis, basis.functions.order};
  for (const double smoothing : detail::kSmoothings) {
    const double error_mm = detail::rms(held_out(basis, normals, grid, grid.wanted_mm, smoothing).errors, grid.used);
    if (error_mm < best.held_out_mm) best = {best.basis, best.order, smoothing, error_mm};
  }
  return best;
}

/// Takes out what does not fit the rest, the farthest first, so that one that drags its neighbours along does not take
/// them with it; then looks at all again.
Result<void> screen(std::span<const FieldSample> samples, const SmoothedBasis& basis, double smoothing, double least_mm,
                    MeasuredGrid& grid, FieldFit& fit) {
  for (int round = 0; round < kScreenings; ++round) {
    const auto normals = normals_of(basis, grid, grid.wanted_mm);
    auto [errors, variance] = held_out(basis, normals, grid, grid.wanted_mm, smoothing);
    // At the volume's edge, where its neighbours are on one side only, a sample is predicted worse: no fault of its
    // own.
    for (std::size_t i = 0; i < errors.size(); ++i) errors[i] /= std::sqrt(1 + variance[i]);
    const auto far = detail::far_off(errors, grid.used, least_mm);
    double farthest = 0;
    for (std::size_t i = 0; i < far.size(); ++i) {
      if (grid.used[i] && far[i]) farthest = std::max(farthest, errors[i].norm());
    }
    bool changed = false;
    for (std::size_t i = 0; i < far.size(); ++i) {
      const bool out = far[i] && (!grid.used[i] || errors[i].norm() > farthest / 2);
      changed = changed || out == grid.used[i];
      grid.used[i] = !out;
    }
    if (!changed) return {};
    if (const auto aligned = align(samples, grid, fit); !aligned) return aligned.error();
  }
  return {};
}

/// Rotation vectors that orientations lack, rad; empty where one of the samples does not know its own.
Vectors wanted_rotations(std::span<const FieldSample> samples, const std::vector<bool>& used, const FieldFit& fit) {
  const Eigen::Matrix3d turn = fit.tracker_from_board->rotation();
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!samples[i].true_rotation) return {};
    if (used[i]) sum += samples[i].true_rotation->transpose() * turn.transpose() * samples[i].measured.rotation();
  }
  const Eigen::Matrix3d holder_from_sensor = nearest_rotation(sum);
  Vectors out;
  for (const FieldSample& s : samples)
    out.push_back(rotation_log(turn * *s.true_rotation * holder_from_sensor * s.measured.rotation().transpose()));
  return out;
}

Vectors coefficients(const SmoothedBasis& basis, const MatrixXd& parameters) {
  const MatrixXd raw = basis.embedding * parameters;
  Vectors out;
  for (Eigen::Index i = 0; i < raw.rows(); ++i) out.emplace_back(raw.row(i).transpose());
  return out;
}

/// Of a new measurement: sigma^2 (1 + f^T A^-1 f) per axis, with sigma from how far held-out ones were off.
std::vector<double> sigmas(const SmoothedBasis& basis, const MeasuredGrid& grid, const HeldOutErrors& held,
                           const std::vector<bool>& beyond, const MatrixXd& inverse) {
  double sum = 0, count = 0;
  Vectors places;
  for (std::size_t i = 0; i < held.errors.size(); ++i) {
    if (!grid.used[i]) continue;
    places.push_back(grid.measured_mm[i]);
    if (beyond[i]) continue;
    sum += held.errors[i].squaredNorm() / (1 + held.variance[i]);
    ++count;
  }
  const double variance = sum / count;
  return detail::sigma_lattice(basis.functions, places, detail::reach_mm(basis.functions, places),
                               [&](const Eigen::Vector3d& place) {
                                 const Eigen::RowVectorXd row = basis.row(place);
                                 return std::sqrt(variance * (1 + row * inverse * row.transpose()));
                               });
}

/// Which outliers have another one within reach, at another place: two sensors are not badly seated side by side, but
/// metal bends the field about several places.
std::vector<bool> beside_one_another(const MeasuredGrid& grid, double reach_mm) {
  constexpr double kOnePlace = 0.1;  // of the reach: a place that was measured twice
  std::vector<bool> out(grid.used.size(), false);
  for (std::size_t i = 0; i < out.size(); ++i) {
    for (std::size_t k = 0; k < out.size() && !grid.used[i] && !out[i]; ++k) {
      const double apart_mm = (grid.measured_mm[i] - grid.measured_mm[k]).norm();
      out[i] = !grid.used[k] && apart_mm > kOnePlace * reach_mm && apart_mm <= reach_mm;
    }
  }
  return out;
}

/// Takes what lies about these places off the map.
void leave_out(const MeasuredGrid& grid, const std::vector<bool>& bent, double reach_mm, FieldMapData& data) {
  Vectors places;
  for (std::size_t i = 0; i < bent.size(); ++i) {
    if (bent[i]) places.push_back(grid.measured_mm[i]);
  }
  const auto bent_nodes =
      detail::sigma_lattice(data.functions, places, reach_mm, [](const Eigen::Vector3d&) { return 1.0; });
  for (std::size_t node = 0; node < bent_nodes.size(); ++node) {
    if (bent_nodes[node] > 0) data.sigma_mm[node] = -1;
  }
}

Result<void> finish(std::span<const FieldSample> samples, const SmoothedBasis& basis, const MeasuredGrid& grid,
                    FieldFit& fit) {
  const double smoothing = fit.chosen.smoothing;
  const auto normals = normals_of(basis, grid, grid.wanted_mm);
  const auto held = held_out(basis, normals, grid, grid.wanted_mm, smoothing);
  const auto solution = normals.solve(smoothing, -1);
  FieldMapData data{basis.functions, coefficients(basis, solution.parameters), {}, {}};
  const std::vector<bool> beyond = extrapolated(held, grid);
  data.sigma_mm = sigmas(basis, grid, held, beyond, solution.inverse);
  const double reach_mm = detail::reach_mm(basis.functions, grid.measured_mm);
  const std::vector<bool> bent = beside_one_another(grid, reach_mm);
  leave_out(grid, bent, reach_mm, data);
  const Vectors rotations = wanted_rotations(samples, grid.used, fit);
  if (!rotations.empty()) {
    const auto turning = normals_of(basis, grid, rotations);
    data.rotation_rad = coefficients(basis, turning.solve(smoothing, -1).parameters);
    fit.before_deg = kDegPerRad * detail::rms(rotations, grid.used);
    fit.held_out_deg = kDegPerRad * detail::rms(held_out(basis, turning, grid, rotations, smoothing).errors, grid.used);
  }
  auto map = FieldMap::from(std::move(data));
  if (!map) return map.error();
  fit.map = *std::move(map);
  Vectors used_mm;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (grid.used[i]) used_mm.push_back(grid.measured_mm[i]);
  }
  detail::take_mapped(used_mm, fit);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    fit.residuals.push_back(
        {samples[i].name, grid.measured_mm[i], -grid.wanted_mm[i], held.errors[i], !grid.used[i], bent[i], beyond[i]});
  }
  detail::sum_up(fit);
  return {};
}

/// A map that changes nothing, until there is one.
FieldMap no_map(const FieldFunctions& box) {
  FieldMapData data;
  data.functions = box;
  data.position_mm.assign(box.count(), Eigen::Vector3d::Zero());
  data.sigma_mm.assign(FieldMapData::kNodes * FieldMapData::kNodes * FieldMapData::kNodes, -1);
  return *FieldMap::from(std::move(data));
}

Error other_lengths(double scale) {
  return {Errc::bad_value,
          fmt::format("the tracker has distances {:.4g} times those of the grid, which are in mm: say the unit of "
                      "the tracker's (--unit m, cm or in), and see that the grid's step is right",
                      scale)};
}

bool is_mirrored(std::span<const FieldSample> samples, const Vectors& measured_mm) {
  constexpr double kFarBetter = 3;
  Vectors true_mm;
  true_mm.reserve(samples.size());
  for (const FieldSample& s : samples) true_mm.push_back(s.true_mm);
  const PointShape shape = compare_shapes(measured_mm, true_mm);
  return shape.mirrored_fre_rms_mm < shape.fre_rms_mm / kFarBetter;
}

/// How far the measured places lie from their middle, as a multiple of how far the true ones do; root mean square.
double spread_ratio(std::span<const FieldSample> samples) {
  Eigen::Vector3d measured_mm = Eigen::Vector3d::Zero(), true_mm = Eigen::Vector3d::Zero();
  for (const FieldSample& s : samples) {
    measured_mm += s.measured.translation() / static_cast<double>(samples.size());
    true_mm += s.true_mm / static_cast<double>(samples.size());
  }
  double measured = 0, truth = 0;
  for (const FieldSample& s : samples) {
    measured += (s.measured.translation() - measured_mm).squaredNorm();
    truth += (s.true_mm - true_mm).squaredNorm();
  }
  return std::sqrt(measured / truth);
}

}  // namespace

Result<FieldFit> fit_field(std::span<const FieldSample> samples, const FieldFitSettings& settings) {
  if (samples.size() < kFewestSamples)
    return Error{Errc::degenerate, fmt::format("{} samples; a map needs {} at least, and a good one over a hundred",
                                               samples.size(), kFewestSamples)};
  MeasuredGrid grid;
  for (const FieldSample& s : samples) {
    if (!s.true_mm.allFinite() || !s.measured.matrix().allFinite())
      return Error{Errc::bad_value, s.name + ": holds what is not a finite number; take it out"};
    grid.measured_mm.push_back(s.measured.translation());
  }
  grid.used.assign(samples.size(), true);
  grid.wanted_mm.resize(samples.size());
  // Before the places' box: by lengths in m it is too small, and the words would be of that.
  if (const double ratio = spread_ratio(samples); ratio < kLeastSpreadRatio || ratio > 1 / kLeastSpreadRatio)
    return other_lengths(ratio);
  auto box = detail::box_of(grid.measured_mm);
  if (!box) return box.error();
  FieldFit fit{no_map(*box)};
  if (const auto aligned = align(samples, grid, fit); !aligned) return aligned.error();
  if (is_mirrored(samples, grid.measured_mm)) {
    return Error{Errc::bad_value,
                 "the measured places are the mirror image of the grid: two of its axes are exchanged, in the table or "
                 "in the order of the places, or one has its sign turned; write the grid down with x to the right, y "
                 "forward and z up"};
  }
  if (fit.scale < kLeastScale || fit.scale > kMostScale) return other_lengths(fit.scale);
  for (const Eigen::Vector3d& p : grid.measured_mm) grid.fold.push_back(detail::fold_of(*box, p));

  FieldFunctions first = *box;  // smooth enough for wrong places to stand out, and of few parameters
  first.order = samples.size() > 100 ? 3 : 2;
  constexpr double kFirstSmoothing = 1e-5;
  if (const auto screened =
          screen(samples, detail::smoothed(first), kFirstSmoothing, detail::kLeastOutlierAtFirstMm, grid, fit);
      !screened)
    return screened.error();

  // An outlier may lie far outside: the box is that of what is used.
  Vectors used_mm, true_mm;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!grid.used[i]) continue;
    used_mm.push_back(grid.measured_mm[i]);
    true_mm.push_back(*fit.tracker_from_board * samples[i].true_mm);
  }
  box = detail::box_of(used_mm);
  if (!box) return box.error();
  // Of the true places: as measured, the field blurs the levels.
  if (const auto levels = detail::check_levels(true_mm, *box); !levels) return levels.error();
  for (std::size_t i = 0; i < samples.size(); ++i) grid.fold[i] = detail::fold_of(*box, grid.measured_mm[i]);
  const auto functions = detail::families(*box, used_mm, settings.basis, used_mm.size() * 9 / 10);
  std::vector<SmoothedBasis> bases;
  for (const FieldFunctions& f : functions) {
    bases.push_back(detail::smoothed(f));
    fit.candidates.push_back(best_smoothing(bases.back(), grid));
  }
  if (bases.empty()) return Error{Errc::degenerate, "too few samples for this kind of map; take more, or --kind auto"};
  const std::size_t best = detail::best_of(fit.candidates, functions);
  if (const auto screened =
          screen(samples, bases[best], fit.candidates[best].smoothing, detail::kLeastOutlierMm, grid, fit);
      !screened)
    return screened.error();
  fit.chosen = fit.candidates[best];
  if (const auto done = finish(samples, bases[best], grid, fit); !done) return done.error();
  fit.chosen.held_out_mm = fit.held_out_mm;
  fit.stretch = detail::stretch_of(samples, grid.used);
  // A level far off is no outlier, though all its places are: look at it first.
  fit.shifted_level = detail::shifted_level(samples, std::vector<bool>(samples.size(), true), *fit.tracker_from_board);
  if (!fit.shifted_level) fit.shifted_level = detail::shifted_level(samples, grid.used, *fit.tracker_from_board);
  return fit;
}

}  // namespace birdseye::calibration
