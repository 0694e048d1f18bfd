#include "calibration/field/field_regression.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <utility>

#include "calibration/base/median.hpp"

namespace birdseye::calibration::detail {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Keeps the normal matrix invertible where rounding would not; far below what measurements say.
constexpr double kRidge = 1e-12;

MatrixXd polynomial_penalty(int order) {
  std::vector<double> weights;
  for (int k = 0; k <= order; ++k) {
    for (int j = 0; j <= order - k; ++j) {
      for (int i = 0; i <= order - k - j; ++i) weights.push_back(std::pow(std::max(0, i + j + k - 1), 4));
    }
  }
  return Eigen::Map<Eigen::VectorXd>(weights.data(), static_cast<Index>(weights.size())).asDiagonal();
}

MatrixXd bernstein_penalty(int order) {
  const Index n = order + 1;
  MatrixXd penalty = MatrixXd::Zero(n * n * n, n * n * n);
  const Index steps[] = {1, n, n * n};
  for (Index at = 0; at < n * n * n; ++at) {
    for (const Index step : steps) {
      const Index along = at / step % n;
      if (along == 0 || along == n - 1) continue;
      Eigen::RowVectorXd second = Eigen::RowVectorXd::Zero(n * n * n);
      second[at - step] = second[at + step] = 1;
      second[at] = -2;
      penalty += second.transpose() * second;
    }
  }
  return penalty;
}

}  // namespace

int fold_of(const FieldFunctions& box, const Eigen::Vector3d& position_mm) {
  constexpr int kCells = 5;
  const int strides[] = {1, 3, 5};
  int sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double part = (position_mm[axis] - box.low_mm[axis]) / (box.high_mm[axis] - box.low_mm[axis]);
    sum += strides[axis] * std::clamp(static_cast<int>(part * kCells), 0, kCells - 1);
  }
  return sum % kFolds;
}

Eigen::RowVectorXd SmoothedBasis::row(const Eigen::Vector3d& position_mm) const {
  std::array<double, FieldFunctions::kMost> values{};
  functions.evaluate(position_mm, values);
  return Eigen::Map<const Eigen::RowVectorXd>(values.data(), embedding.rows()) * embedding;
}

SmoothedBasis smoothed(FieldFunctions functions) {
  SmoothedBasis basis{std::move(functions), {}, {}};
  const auto count = static_cast<Index>(basis.functions.count());
  if (basis.functions.basis != FieldBasis::rbf) {
    const bool tensor = basis.functions.basis == FieldBasis::bernstein;
    basis.embedding = MatrixXd::Identity(count, count);
    basis.penalty = tensor ? bernstein_penalty(basis.functions.order) : polynomial_penalty(basis.functions.order);
    return basis;
  }
  // Weights whose sum and moments vanish: the null space of the affine functions at the centres.
  const auto& centres = basis.functions.centres_mm;
  const auto n = static_cast<Index>(centres.size());
  MatrixXd values(n, count);
  for (Index i = 0; i < n; ++i) {
    std::array<double, FieldFunctions::kMost> row{};
    basis.functions.evaluate(centres[static_cast<std::size_t>(i)], row);
    values.row(i) = Eigen::Map<const Eigen::RowVectorXd>(row.data(), count);
  }
  const Eigen::HouseholderQR<MatrixXd> qr(values.rightCols(4));
  const MatrixXd all = qr.householderQ() * MatrixXd::Identity(n, n);
  const MatrixXd weights = all.rightCols(n - 4);
  basis.embedding = MatrixXd::Zero(count, n);
  basis.embedding.topLeftCorner(n, n - 4) = weights;
  basis.embedding.bottomRightCorner(4, 4).setIdentity();
  basis.penalty = MatrixXd::Zero(n, n);
  // -|r| is positive definite on them.
  basis.penalty.topLeftCorner(n - 4, n - 4) = -weights.transpose() * values.leftCols(n) * weights;
  return basis;
}

std::vector<Eigen::Vector3d> spread_out(std::span<const Eigen::Vector3d> places_mm, std::size_t count) {
  std::vector<Eigen::Vector3d> out;
  if (places_mm.empty()) return out;
  std::vector<double> nearest(places_mm.size(), 1e300);
  std::size_t next = 0;
  while (out.size() < std::min(count, places_mm.size())) {
    out.push_back(places_mm[next]);
    for (std::size_t i = 0; i < places_mm.size(); ++i)
      nearest[i] = std::min(nearest[i], (places_mm[i] - out.back()).squaredNorm());
    next = static_cast<std::size_t>(std::max_element(nearest.begin(), nearest.end()) - nearest.begin());
  }
  return out;
}

FoldedNormals::FoldedNormals(Index parameters, Index columns)
    : gram(kFolds, MatrixXd::Zero(parameters, parameters)),
      moment(kFolds, MatrixXd::Zero(parameters, columns)),
      penalty(MatrixXd::Zero(parameters, parameters)) {}

void FoldedNormals::add(int fold, const MatrixXd& rows, const MatrixXd& values) {
  if (rows.rows() == 0) return;  // Eigen divides by the number of rows when it cuts large products into blocks
  const auto at = static_cast<std::size_t>(fold);
  gram[at].selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
  moment[at] += rows.transpose().lazyProduct(values);  // few columns: nothing is gained by blocks
}

void FoldedNormals::scale_penalty(const MatrixXd& rough) {
  double trace = 0;
  for (const MatrixXd& part : gram) trace += part.trace();
  penalty = rough.trace() > 0 ? MatrixXd(rough * (trace / rough.trace())) : rough;
  ridge = kRidge * trace;
}

FoldedNormals::Solution FoldedNormals::solve(double smoothing, int left_out) const {
  MatrixXd normal = smoothing * penalty;
  normal.diagonal().array() += ridge;
  MatrixXd right = MatrixXd::Zero(moment[0].rows(), moment[0].cols());
  for (int fold = 0; fold < kFolds; ++fold) {
    if (fold == left_out) continue;
    normal.triangularView<Eigen::Lower>() += gram[static_cast<std::size_t>(fold)];
    right += moment[static_cast<std::size_t>(fold)];
  }
  const Eigen::LDLT<MatrixXd, Eigen::Lower> factors(normal);
  return {factors.solve(right), factors.solve(MatrixXd::Identity(normal.rows(), normal.cols()))};
}

Eigen::Vector3d place_of_node(const FieldFunctions& box, std::size_t node) {
  constexpr std::size_t kNodes = FieldMapData::kNodes;
  const std::size_t x = node % kNodes, y = node / kNodes % kNodes, z = node / (kNodes * kNodes);
  const Eigen::Vector3d part = Eigen::Vector3d(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)) /
                               static_cast<double>(kNodes - 1);
  return box.low_mm + part.cwiseProduct(box.high_mm - box.low_mm);
}

double reach_mm(const FieldFunctions& box, std::span<const Eigen::Vector3d> places_mm) {
  constexpr double kPartOfDiagonal = 0.125;
  constexpr double kSpare = 1.3;  // a cell's middle is 0.87 of its side from its corners
  constexpr std::size_t kMostLooked = 2000;
  std::vector<double> nearest;
  const std::size_t step = 1 + places_mm.size() / kMostLooked;
  for (std::size_t i = 0; i < places_mm.size(); i += step) {
    double best = 1e300;
    for (std::size_t k = 0; k < places_mm.size(); k += step) {
      if (k != i) best = std::min(best, (places_mm[i] - places_mm[k]).norm());
    }
    nearest.push_back(best);
  }
  return std::max(kSpare * median_of(nearest), kPartOfDiagonal * (box.high_mm - box.low_mm).norm());
}

}  // namespace birdseye::calibration::detail
