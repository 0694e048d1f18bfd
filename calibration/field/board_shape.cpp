#include "calibration/field/board_shape.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace birdseye::calibration::detail {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr std::size_t kFewestLevels = 4, kMostLevels = 20, kFewestInLevel = 4;
constexpr double kSameLevelMm = 0.5;
constexpr double kLeastShiftMm = 3;     // less may be the field's own
constexpr double kMostOfTheRest = 0.4;  // of the squares that the polynomial leaves

/// Of one axis: the levels' places on it, and the level of each sample.
struct Levels {
  std::vector<double> at_mm;
  std::vector<std::size_t> of;
};

std::optional<Levels> levels_along(int axis, const std::vector<Eigen::Vector3d>& places_mm) {
  std::vector<double> sorted;
  sorted.reserve(places_mm.size());
  for (const Eigen::Vector3d& place : places_mm) sorted.push_back(place[axis]);
  std::sort(sorted.begin(), sorted.end());
  Levels out;
  for (const double at : sorted) {
    if (out.at_mm.empty() || at - out.at_mm.back() > kSameLevelMm) out.at_mm.push_back(at);
    if (out.at_mm.size() > kMostLevels) return std::nullopt;
  }
  if (out.at_mm.size() < kFewestLevels) return std::nullopt;
  std::vector<std::size_t> counts(out.at_mm.size());
  out.of.reserve(places_mm.size());
  for (const Eigen::Vector3d& place : places_mm) {
    const auto after = std::upper_bound(out.at_mm.begin(), out.at_mm.end(), place[axis]);
    out.of.push_back(static_cast<std::size_t>(after - out.at_mm.begin()) - 1);
    ++counts[out.of.back()];
  }
  if (*std::ranges::min_element(counts) < kFewestInLevel) return std::nullopt;
  return out;
}

MatrixXd polynomial(const std::vector<Eigen::Vector3d>& places_mm, int order) {
  Eigen::Vector3d low = places_mm.front(), high = low;
  for (const Eigen::Vector3d& p : places_mm) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Eigen::Vector3d half = (high - low).cwiseMax(1) / 2;
  MatrixXd rows(static_cast<Index>(places_mm.size()), order == 2 ? 10 : 4);
  for (Index i = 0; i < rows.rows(); ++i) {
    const Eigen::Vector3d u = (places_mm[static_cast<std::size_t>(i)] - (low + high) / 2).cwiseQuotient(half);
    rows.row(i).head<4>() << 1, u.x(), u.y(), u.z();
    if (order == 2)
      rows.row(i).tail<6>() << u.x() * u.x(), u.y() * u.y(), u.z() * u.z(), u.x() * u.y(), u.y() * u.z(), u.z() * u.x();
  }
  return rows;
}

}  // namespace

Eigen::Vector3d stretch_of(std::span<const FieldSample> samples, const std::vector<bool>& used) {
  const auto count = static_cast<Index>(std::ranges::count(used, true));
  MatrixXd rows(count, 4), values(count, 3);
  Index at = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!used[i]) continue;
    rows.row(at) << samples[i].true_mm.transpose(), 1;
    values.row(at++) = samples[i].measured.translation().transpose();
  }
  const MatrixXd affine = rows.colPivHouseholderQr().solve(values);
  return affine.topRows<3>().rowwise().norm();
}

std::optional<ShiftedLevel> shifted_level(std::span<const FieldSample> samples, const std::vector<bool>& used,
                                          const Transform<Tracker, Marker>& tracker_from_board) {
  std::vector<Eigen::Vector3d> places_mm, errors_mm;
  const auto board_from_tracker = tracker_from_board.inverse();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!used[i]) continue;
    places_mm.push_back(samples[i].true_mm);
    errors_mm.emplace_back(board_from_tracker * samples[i].measured.translation() - samples[i].true_mm);
  }
  MatrixXd values(static_cast<Index>(errors_mm.size()), 3);
  for (Index i = 0; i < values.rows(); ++i) values.row(i) = errors_mm[static_cast<std::size_t>(i)].transpose();
  std::optional<ShiftedLevel> found;
  double least_part = kMostOfTheRest;
  for (int axis = 0; axis < 3; ++axis) {
    const auto levels = levels_along(axis, places_mm);
    if (!levels) continue;
    const Eigen::ColPivHouseholderQR<MatrixXd> smooth(
        polynomial(places_mm, levels->at_mm.size() > kFewestLevels ? 2 : 1));
    const auto left_by_smooth = [&](const MatrixXd& of) {
      MatrixXd turned = smooth.householderQ().transpose() * of;
      turned.topRows(smooth.rank()).setZero();
      return turned;
    };
    const MatrixXd left = left_by_smooth(values);
    for (std::size_t level = 0; level < levels->at_mm.size(); ++level) {
      Eigen::VectorXd in_level(values.rows());
      for (Index i = 0; i < in_level.size(); ++i)
        in_level[i] = levels->of[static_cast<std::size_t>(i)] == level ? 1 : 0;
      const MatrixXd own = left_by_smooth(in_level);
      const double weight = own.squaredNorm();
      if (weight < 1e-3) continue;  // the polynomial can make the shift by itself
      const Eigen::RowVector3d shift_mm = own.transpose() * left / weight;
      const double part = 1 - shift_mm.squaredNorm() * weight / left.squaredNorm();
      if (shift_mm.norm() < kLeastShiftMm || part >= least_part) continue;
      least_part = part;
      found = ShiftedLevel{axis, level + 1, levels->at_mm[level], shift_mm.transpose()};
    }
  }
  return found;
}

}  // namespace birdseye::calibration::detail
