#include "calibration/field/field_pairs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/base/counted.hpp"
#include "calibration/base/median.hpp"
#include "calibration/field/field_fit_parts.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

using detail::FoldedNormals;
using detail::kFolds;
using detail::SmoothedBasis;
using Eigen::Index;
using Eigen::MatrixXd;
using Vectors = std::vector<Eigen::Vector3d>;

constexpr std::size_t kFewestPairs = 100, kMostPairs = 1500;
constexpr double kRigidPart =
    0.25;                           // of the body's length: no field that is worth a map moves half of all pairs so far
constexpr double kShortestMm = 30;  // a shorter body turns the sensors' noise into a larger error of the map
constexpr double kMmPerRad = 200;   // 1.8 mm against 0.5 deg: what such a sensor's position and orientation are worth
// The map has no rigid motion of its own, and no scale where none is known: said as strongly as measurements would.
constexpr double kGaugeWeight = 10;
constexpr std::size_t kMostFunctions = 64;  // six parameters each
constexpr int kSteps = 3;

/// The body as it is: sensor b in a's frame.
struct SensorPair {
  Eigen::Vector3d b_in_a_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d a_from_b = Eigen::Matrix3d::Identity();
};

struct FoldedPairs {
  std::vector<FieldPair> pairs;
  std::vector<bool> used;
  std::vector<int> fold;
  Vectors places_mm;  ///< of both sensors, those of pair i at 2i and 2i + 1
  std::optional<double> distance_mm;
};

/// Parameters: the map of positions (3 for each function), that of orientations, and b's place in a.
class PairModel {
 public:
  explicit PairModel(SmoothedBasis basis) : basis_(std::move(basis)), n_(basis_.size()) {}

  [[nodiscard]] Index parameters() const { return 6 * n_ + 3; }
  [[nodiscard]] const SmoothedBasis& basis() const { return basis_; }
  [[nodiscard]] Eigen::Vector3d shift(const Eigen::RowVectorXd& row, const Eigen::VectorXd& theta, bool turn) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    const Index from = turn ? 3 * n_ : 0;
    for (Index i = 0; i < n_; ++i) sum += row[i] * theta.segment<3>(from + 3 * i);
    return sum;
  }
  [[nodiscard]] Eigen::VectorXd start(const SensorPair& body) const {
    Eigen::VectorXd theta = Eigen::VectorXd::Zero(parameters());
    theta.tail<3>() = body.b_in_a_mm;
    return theta;
  }

  /// Six equations of a pair, linear at theta: rows * theta = values. With r the difference between where b is and
  /// where the body has it,
  ///   r = p_b + c(p_b) - p_a - c(p_a) - R_a' x,   R_a' = exp(w(p_a)) R_a,
  ///   dr = f_b dc - f_a dc + [R_a' x] f_a dw - R_a' dx,
  /// and of the orientations log(R_a' Y R_b'^T) = f_b dw - f_a dw, times kMmPerRad.
  void linearise(const FieldPair& pair, const SensorPair& body, const Eigen::VectorXd& theta, MatrixXd& rows,
                 Eigen::Matrix<double, 6, 1>& values) const {
    const Eigen::RowVectorXd fa = basis_.row(pair.a.translation()), fb = basis_.row(pair.b.translation());
    const Eigen::Matrix3d ra = rotation_exp(shift(fa, theta, true)) * pair.a.rotation();
    const Eigen::Matrix3d rb = rotation_exp(shift(fb, theta, true)) * pair.b.rotation();
    const Eigen::Vector3d arm = ra * theta.tail<3>();
    const Eigen::Matrix3d turned = cross_matrix(arm);
    rows.setZero(6, parameters());
    for (Index i = 0; i < n_; ++i) {
      for (int axis = 0; axis < 3; ++axis) rows(axis, 3 * i + axis) = fb[i] - fa[i];
      rows.block<3, 3>(0, 3 * n_ + 3 * i) = fa[i] * turned;
      for (int axis = 0; axis < 3; ++axis) rows(3 + axis, 3 * n_ + 3 * i + axis) = kMmPerRad * (fb[i] - fa[i]);
    }
    rows.block<3, 3>(0, 6 * n_) = -ra;
    values.head<3>() = -residual(pair, fa, fb, arm, theta);
    values.tail<3>() = kMmPerRad * rotation_log(ra * body.a_from_b * rb.transpose());
    values += rows * theta;
  }

  [[nodiscard]] Eigen::Vector3d residual(const FieldPair& pair, const Eigen::VectorXd& theta) const {
    const Eigen::RowVectorXd fa = basis_.row(pair.a.translation()), fb = basis_.row(pair.b.translation());
    const Eigen::Vector3d arm = rotation_exp(shift(fa, theta, true)) * pair.a.rotation() * theta.tail<3>();
    return residual(pair, fa, fb, arm, theta);
  }

  [[nodiscard]] MatrixXd penalty() const {
    MatrixXd out = MatrixXd::Zero(parameters(), parameters());
    for (Index i = 0; i < n_; ++i) {
      for (Index k = 0; k < n_; ++k) {
        for (int axis = 0; axis < 3; ++axis) {
          out(3 * i + axis, 3 * k + axis) = basis_.penalty(i, k);
          out(3 * (n_ + i) + axis, 3 * (n_ + k) + axis) = kMmPerRad * kMmPerRad * basis_.penalty(i, k);
        }
      }
    }
    return out;
  }

 private:
  [[nodiscard]] Eigen::Vector3d residual(const FieldPair& pair, const Eigen::RowVectorXd& fa,
                                         const Eigen::RowVectorXd& fb, const Eigen::Vector3d& arm,
                                         const Eigen::VectorXd& theta) const {
    return pair.b.translation() + shift(fb, theta, false) - pair.a.translation() - shift(fa, theta, false) - arm;
  }

  SmoothedBasis basis_;
  Index n_;
};

/// What pairs cannot see, said of the map: its sums over the samples, their moments, and the scale.
void add_gauge(const PairModel& model, const FoldedPairs& data, const SensorPair& body, FoldedNormals& normals) {
  const FieldFunctions& box = model.basis().functions;
  const Eigen::Vector3d middle_mm = (box.low_mm + box.high_mm) / 2;
  const double size_mm = (box.high_mm - box.low_mm).norm() / 2;
  const Index n = model.basis().size();
  const auto count = static_cast<double>(data.places_mm.size());
  MatrixXd rows = MatrixXd::Zero(7, model.parameters());
  for (const Eigen::Vector3d& place : data.places_mm) {
    const Eigen::RowVectorXd f = model.basis().row(place) / count;
    const Eigen::Vector3d arm = (place - middle_mm) / size_mm;
    for (Index i = 0; i < n; ++i) {
      for (int axis = 0; axis < 3; ++axis) rows(axis, 3 * i + axis) += f[i];
      rows.block<3, 3>(3, 3 * i) += f[i] * cross_matrix(arm);
      rows.block<1, 3>(6, 3 * i) += f[i] * arm.transpose();
    }
  }
  Eigen::Matrix<double, 7, 1> values = Eigen::Matrix<double, 7, 1>::Zero();
  if (data.distance_mm) {  // the body's length in place of the map's scale
    rows.row(6).setZero();
    rows.block<1, 3>(6, 6 * n) = body.b_in_a_mm.normalized().transpose();
    values[6] = *data.distance_mm;
  }
  const double weight = kGaugeWeight * std::sqrt(count) / kFolds;  // once for each fold, so that none goes without
  for (int fold = 0; fold < kFolds; ++fold) normals.add(fold, weight * rows, weight * values);
}

struct GaussNewtonEquations {
  FoldedNormals normals;
  Eigen::VectorXd theta;
};

/// Gauss-Newton: the equations at the last step's solution.
GaussNewtonEquations equations(const PairModel& model, const FoldedPairs& data, const SensorPair& body,
                               double smoothing) {
  GaussNewtonEquations out{FoldedNormals(model.parameters(), 1), model.start(body)};
  MatrixXd rows;
  Eigen::Matrix<double, 6, 1> values;
  for (int step = 0; step < kSteps; ++step) {
    out.normals = FoldedNormals(model.parameters(), 1);
    std::vector<MatrixXd> stacked(kFolds);
    for (int fold = 0; fold < kFolds; ++fold) {
      const auto in = std::count_if(data.pairs.begin(), data.pairs.end(), [&, i = std::size_t{0}](const auto&) mutable {
        const bool here = data.used[i] && data.fold[i] == fold;
        ++i;
        return here;
      });
      MatrixXd all(6 * in, model.parameters());
      Eigen::VectorXd right(6 * in);
      Index at = 0;
      for (std::size_t i = 0; i < data.pairs.size(); ++i) {
        if (!data.used[i] || data.fold[i] != fold) continue;
        model.linearise(data.pairs[i], body, out.theta, rows, values);
        all.middleRows(at, 6) = rows;
        right.segment<6>(at) = values;
        at += 6;
      }
      out.normals.add(fold, all, right);
    }
    add_gauge(model, data, body, out.normals);
    out.normals.scale_penalty(model.penalty());
    out.theta = out.normals.solve(smoothing, -1).parameters;
  }
  return out;
}

Vectors held_out(const PairModel& model, const GaussNewtonEquations& linear, const FoldedPairs& data,
                 double smoothing) {
  Vectors errors(data.pairs.size());
  for (int fold = 0; fold < kFolds; ++fold) {
    const Eigen::VectorXd theta = linear.normals.solve(smoothing, fold).parameters;
    for (std::size_t i = 0; i < data.pairs.size(); ++i) {
      if (data.fold[i] == fold) errors[i] = model.residual(data.pairs[i], theta);
    }
  }
  return errors;
}

SensorPair mean_body(const FoldedPairs& data) {
  Eigen::Matrix3d turns = Eigen::Matrix3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  for (std::size_t i = 0; i < data.pairs.size(); ++i) {
    if (!data.used[i]) continue;
    const FieldPair& pair = data.pairs[i];
    turns += pair.a.rotation().transpose() * pair.b.rotation();
    sum += pair.a.rotation().transpose() * (pair.b.translation() - pair.a.translation());
    ++count;
  }
  return {sum / count, nearest_rotation(turns)};
}

/// Half of all pairs have b farther than this from where they have it on average, in a's frame.
double median_slip_mm(const FoldedPairs& data, const SensorPair& body) {
  std::vector<double> slips_mm;
  slips_mm.reserve(data.pairs.size());
  for (const FieldPair& pair : data.pairs) {
    const Eigen::Vector3d b_in_a_mm = pair.a.rotation().transpose() * (pair.b.translation() - pair.a.translation());
    slips_mm.push_back((b_in_a_mm - body.b_in_a_mm).norm());
  }
  return median_of(std::move(slips_mm));
}

/// From sensor to sensor as measured, which no error of an orientation touches.
double median_distance_mm(const FoldedPairs& data) {
  std::vector<double> distances_mm;
  distances_mm.reserve(data.pairs.size());
  for (std::size_t i = 0; i < data.pairs.size(); ++i) {
    if (!data.used[i]) continue;
    distances_mm.push_back((data.pairs[i].b.translation() - data.pairs[i].a.translation()).norm());
  }
  return median_of(std::move(distances_mm));
}

constexpr const char* kOneBody = "give the poses of two sensors that are fixed to one bar, recorded together";

/// Refuses two sensors that are not fixed to each other, and those too close.
Result<void> check_body(const FoldedPairs& data) {
  const SensorPair body = mean_body(data);
  const double length_mm = body.b_in_a_mm.norm(), slip_mm = median_slip_mm(data, body);
  if (!(slip_mm <= kRigidPart * length_mm))
    return Error{Errc::degenerate,
                 fmt::format("these two do not sit on one rigid body: in the first's frame the second is {:.3g} mm "
                             "away on average, and in half of the pairs more than {:.3g} mm from there; {}",
                             length_mm, slip_mm, kOneBody)};
  if (length_mm >= kShortestMm) return {};
  return Error{
      Errc::degenerate,
      fmt::format("the sensors are {:.2g} mm apart; a map needs {:.0f} mm between them at least (of lengths in "
                  "metres or cm: --unit m, --unit cm)",
                  length_mm, kShortestMm)};
}

/// The least variance of the direction from a to b.
double direction_spread(const FoldedPairs& data) {
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const FieldPair& pair : data.pairs) {
    const Eigen::Vector3d along = (pair.b.translation() - pair.a.translation()).normalized();
    scatter += along * along.transpose() / static_cast<double>(data.pairs.size());
  }
  return symmetric_eigenvalues(scatter)[0];
}

Vectors before(const FoldedPairs& data, const SensorPair& body) {
  Vectors out;
  for (const FieldPair& pair : data.pairs)
    out.push_back(pair.b.translation() - pair.a.translation() - pair.a.rotation() * body.b_in_a_mm);
  return out;
}

Result<FoldedPairs> taken(std::span<const FieldPair> pairs, const FieldPairSettings& settings) {
  if (pairs.size() < kFewestPairs)
    return Error{Errc::degenerate,
                 fmt::format("{} of poses at the same moment; a map needs {} at least, and a good one "
                             "over a thousand",
                             counted(pairs.size(), "pair", "pairs"), kFewestPairs)};
  FoldedPairs data;
  const std::size_t count = std::min(pairs.size(), kMostPairs);
  for (std::size_t k = 0; k < count; ++k) {
    const FieldPair& pair = pairs[k * pairs.size() / count];
    if (!pair.a.matrix().allFinite() || !pair.b.matrix().allFinite())
      return Error{Errc::bad_value, pair.name + ": holds what is not a finite number; take it out"};
    data.pairs.push_back(pair);
    data.places_mm.push_back(pair.a.translation());
    data.places_mm.push_back(pair.b.translation());
  }
  data.used.assign(count, true);
  data.distance_mm = settings.distance_mm;
  return data;
}

FieldMapData map_of(const PairModel& model, const FoldedPairs& data, const FoldedNormals::Solution& solution,
                    double error_mm) {
  const SmoothedBasis& basis = model.basis();
  const Index n = basis.size();
  FieldMapData map{basis.functions, {}, {}, {}};
  const MatrixXd shifts = Eigen::Map<const MatrixXd>(solution.parameters.data(), 3, n).transpose();
  const MatrixXd turns = Eigen::Map<const MatrixXd>(solution.parameters.data() + 3 * n, 3, n).transpose();
  const MatrixXd position = basis.embedding * shifts, rotation = basis.embedding * turns;
  for (Index i = 0; i < position.rows(); ++i) {
    map.position_mm.emplace_back(position.row(i).transpose());
    map.rotation_rad.emplace_back(rotation.row(i).transpose());
  }
  // The two sensors' errors are in a difference: the variance of one measurement along one axis is a sixth.
  const double variance = error_mm * error_mm / 6;
  const auto at = [&](const Eigen::Vector3d& place) {
    const Eigen::RowVectorXd row = basis.row(place);
    double sum = 3;  // of the measurement there, for noise of variance 1; its variance in the equations is 2
    for (Index axis = 0; axis < 3; ++axis) {
      for (Index i = 0; i < n; ++i) {
        for (Index k = 0; k < n; ++k) sum += 2 * row[i] * row[k] * solution.inverse(3 * i + axis, 3 * k + axis);
      }
    }
    return std::sqrt(variance * sum);
  };
  map.sigma_mm =
      detail::sigma_lattice(basis.functions, data.places_mm, detail::reach_mm(basis.functions, data.places_mm), at);
  return map;
}

FieldCandidate best_smoothing(const PairModel& model, const FoldedPairs& data, const SensorPair& body) {
  constexpr double kForLinearising = 1e-5;
  const GaussNewtonEquations linear = equations(model, data, body, kForLinearising);
  FieldCandidate best{model.basis().functions.basis, model.basis().functions.order};
  for (const double smoothing : detail::kSmoothings) {
    const double error_mm = detail::rms(held_out(model, linear, data, smoothing), data.used);
    if (error_mm < best.held_out_mm) best = {best.basis, best.order, smoothing, error_mm};
  }
  return best;
}

/// Takes out pairs that no smooth map explains; an error where these are most of them.
Result<void> screen(const PairModel& model, double smoothing, FoldedPairs& data) {
  for (int round = 0; round < 2; ++round) {
    const GaussNewtonEquations linear = equations(model, data, mean_body(data), smoothing);
    const auto far =
        detail::far_off(held_out(model, linear, data, smoothing), data.used, detail::kLeastOutlierAtFirstMm);
    for (std::size_t i = 0; i < far.size(); ++i) data.used[i] = !far[i];
    const auto out = static_cast<std::size_t>(std::ranges::count(far, true));
    if (2 * out > far.size())
      return Error{Errc::degenerate,
                   fmt::format("these two do not sit on one rigid body: {} of {} pairs fit no map; {}", out, far.size(),
                               kOneBody)};
  }
  return {};
}

}  // namespace

Result<FieldFit> fit_field_from_pairs(std::span<const FieldPair> pairs, const FieldPairSettings& settings) {
  auto taken_pairs = taken(pairs, settings);
  if (!taken_pairs) return taken_pairs.error();
  FoldedPairs& data = *taken_pairs;
  const auto box = detail::box_of(data.places_mm);
  if (!box) return box.error();
  for (std::size_t i = 0; i < data.pairs.size(); ++i)
    data.fold.push_back(detail::fold_of(*box, (data.places_mm[2 * i] + data.places_mm[2 * i + 1]) / 2));
  if (const auto rigid = check_body(data); !rigid) return rigid.error();
  FieldFunctions first = *box;
  first.order = 2;
  constexpr double kFirstSmoothing = 1e-5;
  if (const auto screened = screen(PairModel(detail::smoothed(first)), kFirstSmoothing, data); !screened)
    return screened.error();

  const SensorPair body = mean_body(data);
  const auto functions = detail::families(*box, data.places_mm, settings.basis, kMostFunctions);
  std::vector<FieldCandidate> candidates;
  candidates.reserve(functions.size());
  for (const FieldFunctions& f : functions)
    candidates.push_back(best_smoothing(PairModel(detail::smoothed(f)), data, body));
  const std::size_t best = detail::best_of(candidates, functions);
  const PairModel model(detail::smoothed(functions[best]));
  const double smoothing = candidates[best].smoothing;
  const GaussNewtonEquations linear = equations(model, data, body, smoothing);
  const Vectors after = held_out(model, linear, data, smoothing);
  const auto solution = linear.normals.solve(smoothing, -1);
  FieldMapData map_data = map_of(model, data, solution, detail::rms(after, data.used));
  auto map = FieldMap::from(std::move(map_data));
  if (!map) return map.error();

  FieldFit fit{*std::move(map)};
  fit.from_pairs = true;
  fit.candidates = std::move(candidates);
  fit.chosen = fit.candidates[best];
  Vectors used_mm;
  for (std::size_t i = 0; i < data.places_mm.size(); ++i) {
    if (data.used[i / 2]) used_mm.push_back(data.places_mm[i]);  // two places a pair
  }
  detail::take_mapped(used_mm, fit);
  fit.a_from_b_mm = solution.parameters.bottomRows<3>();
  fit.direction_spread = direction_spread(data);
  fit.stated_distance_mm = settings.distance_mm;
  fit.measured_distance_mm = median_distance_mm(data);
  const Vectors was = before(data, body);
  for (std::size_t i = 0; i < data.pairs.size(); ++i) {
    const Eigen::Vector3d middle = (data.places_mm[2 * i] + data.places_mm[2 * i + 1]) / 2;
    fit.residuals.push_back({data.pairs[i].name, middle, was[i], after[i], !data.used[i]});
  }
  detail::sum_up(fit);
  return fit;
}

}  // namespace birdseye::calibration
