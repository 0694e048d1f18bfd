#include "calibration/field/field_levels.hpp"

#include <array>
#include <vector>

#include "calibration/geometry/linear_algebra.hpp"

namespace birdseye::calibration::detail {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Of a function's mean square between the places over that at the places. Of three levels it is a few; of two, with
// places that are off them by a hundredth of their distance, thousands.
constexpr double kMostBetween = 100;

MatrixXd mean_squares(std::span<const Eigen::Vector3d> at_mm, const FieldFunctions& functions) {
  const auto count = static_cast<Index>(functions.count());
  MatrixXd rows(static_cast<Index>(at_mm.size()), count);
  std::array<double, FieldFunctions::kMost> values{};
  for (Index i = 0; i < rows.rows(); ++i) {
    functions.evaluate(at_mm[static_cast<std::size_t>(i)], values);
    rows.row(i) = Eigen::Map<const Eigen::RowVectorXd>(values.data(), count);
  }
  return rows.transpose() * rows / static_cast<double>(at_mm.size());
}

/// On the lines from places to others: inside of what the places span, whatever its shape.
std::vector<Eigen::Vector3d> between(std::span<const Eigen::Vector3d> places_mm) {
  constexpr std::size_t kStrides[] = {7, 31, 57, 101, 139};  // from a place of a grid to others at other levels
  constexpr double kParts[] = {0.25, 0.5};                   // three quarters are a quarter from the other end
  std::vector<Eigen::Vector3d> out;
  for (std::size_t i = 0; i < places_mm.size(); ++i) {
    for (const std::size_t stride : kStrides) {
      const Eigen::Vector3d& other = places_mm[(i + stride) % places_mm.size()];
      for (const double part : kParts) out.emplace_back(places_mm[i] + part * (other - places_mm[i]));
    }
  }
  return out;
}

/// Whether the places tell the functions apart: none of their sums is small at all places and large between them.
bool tells_apart(std::span<const Eigen::Vector3d> places_mm, const FieldFunctions& functions) {
  MatrixXd at_places = mean_squares(places_mm, functions);
  constexpr double kRounding = 1e-10;
  at_places.diagonal().array() += kRounding * at_places.trace();
  const auto own = symmetric_eigen(at_places);
  const MatrixXd scaled = own.vectors * own.values.cwiseMax(1e-300).cwiseSqrt().cwiseInverse().asDiagonal();
  const MatrixXd ratios = scaled.transpose() * mean_squares(between(places_mm), functions) * scaled;
  return symmetric_eigen(ratios).values.maxCoeff() <= kMostBetween;
}

}  // namespace

bool OwnBox::holds(const Eigen::Vector3d& place_mm) const {
  const Eigen::Vector3d along = axes.transpose() * place_mm;
  return (along.array() >= low_mm.array()).all() && (along.array() <= high_mm.array()).all();
}

OwnBox own_box(std::span<const Eigen::Vector3d> places_mm) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : places_mm) middle += p / static_cast<double>(places_mm.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : places_mm) scatter += (p - middle) * (p - middle).transpose();
  OwnBox box{symmetric_eigen(scatter).vectors, Eigen::Vector3d::Constant(1e300), Eigen::Vector3d::Constant(-1e300)};
  for (const Eigen::Vector3d& p : places_mm) {
    const Eigen::Vector3d along = box.axes.transpose() * p;
    box.low_mm = box.low_mm.cwiseMin(along);
    box.high_mm = box.high_mm.cwiseMax(along);
  }
  return box;
}

Result<void> check_levels(std::span<const Eigen::Vector3d> places_mm, FieldFunctions box) {
  box.basis = FieldBasis::polynomial;
  box.order = 2;
  if (tells_apart(places_mm, box)) return {};
  return Error{
      Errc::degenerate,
      "the places lie at two levels of the board, or at one, or on one curved surface: how the field bends between "
      "them was not measured, and a map would be off there by more than poses are without it; measure at three levels "
      "or more"};
}

}  // namespace birdseye::calibration::detail
