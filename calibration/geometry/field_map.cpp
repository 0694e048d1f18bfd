#include "calibration/geometry/field_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

constexpr int kMostDegree = 5;
using Powers = std::array<double, kMostDegree + 1>;

/// Legendre polynomials up to degree 4 at u: orthogonal on -1..1, so that their sums are well conditioned.
Powers legendre(double u) {
  const double s = u * u;
  return {1, u, (3 * s - 1) / 2, u * (5 * s - 3) / 2, ((35 * s - 30) * s + 3) / 8, 0};
}

/// Bernstein polynomials of the degree at t of 0..1, by their recurrence.
Powers bernstein(int degree, double t) {
  Powers b{1};
  for (std::size_t n = 1; n <= static_cast<std::size_t>(degree); ++n) {
    for (std::size_t k = n; k > 0; --k) b.at(k) = (1 - t) * (k < n ? b.at(k) : 0) + t * b.at(k - 1);
    b[0] *= 1 - t;
  }
  return b;
}

bool all_finite(const std::vector<Eigen::Vector3d>& vectors) {
  return std::all_of(vectors.begin(), vectors.end(), [](const auto& v) { return v.allFinite(); });
}

Eigen::Vector3d sum_of(const std::vector<Eigen::Vector3d>& coefficients, std::span<const double> values) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < coefficients.size(); ++i) sum += values[i] * coefficients[i];
  return sum;
}

bool inside(const FieldFunctions& box, const Eigen::Vector3d& p) {
  return (p.array() >= box.low_mm.array()).all() && (p.array() <= box.high_mm.array()).all();  // not if it is no number
}

}  // namespace

const char* name_of(FieldBasis basis) {
  switch (basis) {
    case FieldBasis::polynomial:
      return "polynomial";
    case FieldBasis::bernstein:
      return "bernstein";
    case FieldBasis::rbf:
      return "rbf";
  }
  return "none";
}

std::optional<FieldBasis> field_basis_of(const std::string& name) {
  for (const FieldBasis basis : {FieldBasis::polynomial, FieldBasis::bernstein, FieldBasis::rbf}) {
    if (name == name_of(basis)) return basis;
  }
  return std::nullopt;
}

std::size_t FieldFunctions::count() const {
  const auto n = static_cast<std::size_t>(order);
  switch (basis) {
    case FieldBasis::polynomial:
      return (n + 1) * (n + 2) * (n + 3) / 6;
    case FieldBasis::bernstein:
      return (n + 1) * (n + 1) * (n + 1);
    case FieldBasis::rbf:
      return centres_mm.size() + 4;
  }
  return 0;
}

void FieldFunctions::evaluate(const Eigen::Vector3d& position_mm, std::span<double> values) const {
  const Eigen::Vector3d half_mm = (high_mm - low_mm) / 2;
  const Eigen::Vector3d u = (position_mm - low_mm).cwiseQuotient(half_mm) - Eigen::Vector3d::Ones();
  const auto n = static_cast<std::size_t>(order);
  std::size_t at = 0;
  if (basis == FieldBasis::rbf) {
    const double size_mm = half_mm.norm();
    for (const Eigen::Vector3d& centre : centres_mm) values[at++] = (position_mm - centre).norm() / size_mm;
    values[at++] = 1;
    for (int axis = 0; axis < 3; ++axis) values[at++] = u[axis];
    return;
  }
  const bool tensor = basis == FieldBasis::bernstein;
  const auto along = [&](int axis) { return tensor ? bernstein(order, (u[axis] + 1) / 2) : legendre(u[axis]); };
  const Powers x = along(0), y = along(1), z = along(2);
  for (std::size_t k = 0; k <= n; ++k) {
    for (std::size_t j = 0; j <= n - (tensor ? 0 : k); ++j) {
      const double yz = y.at(j) * z.at(k);
      for (std::size_t i = 0; i <= n - (tensor ? 0 : k + j); ++i) values[at++] = x.at(i) * yz;
    }
  }
}

std::string FieldFunctions::fault() const {
  if (!low_mm.allFinite() || !high_mm.allFinite() || !((high_mm - low_mm).minCoeff() > 0)) return "a box without size";
  const int least = basis == FieldBasis::polynomial ? 1 : basis == FieldBasis::bernstein ? 2 : 4;
  const int most = basis == FieldBasis::polynomial ? 4 : basis == FieldBasis::bernstein ? kMostDegree : kMostCentres;
  if (order < least || order > most)
    return fmt::format("{} of order {}; there are {} to {}", name_of(basis), order, least, most);
  const std::size_t centres = basis == FieldBasis::rbf ? static_cast<std::size_t>(order) : 0;
  if (centres_mm.size() != centres) return fmt::format("{} centres in place of {}", centres_mm.size(), centres);
  return all_finite(centres_mm) ? "" : "a centre that is no place";
}

Result<FieldMap> FieldMap::from(FieldMapData data) {
  std::string fault = data.functions.fault();
  const std::size_t count = fault.empty() ? data.functions.count() : 0;
  constexpr std::size_t kAll = FieldMapData::kNodes * FieldMapData::kNodes * FieldMapData::kNodes;
  if (fault.empty() && data.position_mm.size() != count)
    fault = fmt::format("{} coefficients for {} functions", data.position_mm.size(), count);
  if (fault.empty() && !data.rotation_rad.empty() && data.rotation_rad.size() != count)
    fault = fmt::format("{} coefficients of rotation for {} functions", data.rotation_rad.size(), count);
  if (fault.empty() && data.sigma_mm.size() != kAll)
    fault = fmt::format("{} sigmas in place of {}", data.sigma_mm.size(), kAll);
  const bool finite =
      all_finite(data.position_mm) && all_finite(data.rotation_rad) &&
      std::all_of(data.sigma_mm.begin(), data.sigma_mm.end(), [](double s) { return std::isfinite(s); });
  if (fault.empty() && !finite) fault = "a coefficient that is not a finite number";
  if (!fault.empty())
    return Error{Errc::bad_value, "is no map of the field: " + fault + "; make it again with birdseye calibrate field"};
  return FieldMap(std::move(data));
}

std::optional<double> FieldMap::sigma_mm(const Eigen::Vector3d& position_mm) const {
  const FieldFunctions& box = data_.functions;
  if (!inside(box, position_mm)) return std::nullopt;
  constexpr std::size_t kNodes = FieldMapData::kNodes;
  const Eigen::Vector3d at =
      (position_mm - box.low_mm).cwiseQuotient(box.high_mm - box.low_mm) * static_cast<double>(kNodes - 1);
  std::array<std::size_t, 3> cell{};
  Eigen::Vector3d part;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double along = at[static_cast<int>(axis)];
    cell.at(axis) = std::min(static_cast<std::size_t>(along), kNodes - 2);
    part[static_cast<int>(axis)] = along - static_cast<double>(cell.at(axis));
  }
  double sum = 0;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const std::size_t dx = corner & 1U, dy = corner >> 1U & 1U, dz = corner >> 2U;
    const double weight =
        (dx != 0 ? part.x() : 1 - part.x()) * (dy != 0 ? part.y() : 1 - part.y()) * (dz != 0 ? part.z() : 1 - part.z());
    if (weight <= 0) continue;
    const double sigma = data_.sigma_mm[((cell[2] + dz) * kNodes + cell[1] + dy) * kNodes + cell[0] + dx];
    if (sigma < 0) return std::nullopt;
    sum += weight * sigma;
  }
  return sum;
}

std::optional<Eigen::Vector3d> FieldMap::correction_mm(const Eigen::Vector3d& position_mm) const {
  if (const auto sigma = sigma_mm(position_mm); !sigma || *sigma > kMostSigmaMm) return std::nullopt;
  std::array<double, FieldFunctions::kMost> values;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled next
  data_.functions.evaluate(position_mm, values);
  return sum_of(data_.position_mm, values);
}

std::optional<FieldMap::Corrected> FieldMap::correct(const Transform<Tracker, Sensor>& measured) const {
  const Eigen::Vector3d& p = measured.translation();
  const auto sigma = sigma_mm(p);
  if (!sigma || *sigma > kMostSigmaMm) return std::nullopt;
  std::array<double, FieldFunctions::kMost> values;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled next
  data_.functions.evaluate(p, values);
  Eigen::Matrix3d rotation = measured.rotation();
  if (maps_orientation()) rotation = rotation_exp(sum_of(data_.rotation_rad, values)) * rotation;
  return Corrected{{rotation, p + sum_of(data_.position_mm, values)}, *sigma};
}

std::string FieldMap::why_not(const Eigen::Vector3d& position_mm) const {
  const Eigen::Vector3d& p = position_mm;
  if (const auto sigma = sigma_mm(p)) {
    if (*sigma <= kMostSigmaMm) return "";
    return fmt::format("at {:.0f}, {:.0f}, {:.0f} mm the map of the field is sure to {:.1f} mm, of at most {:.1f}",
                       p.x(), p.y(), p.z(), *sigma, kMostSigmaMm);
  }
  const FieldFunctions& box = data_.functions;
  if (inside(box, p))
    return fmt::format("the field was not mapped near {:.0f}, {:.0f}, {:.0f} mm", p.x(), p.y(), p.z());
  const auto& l = box.low_mm;
  const auto& h = box.high_mm;
  return fmt::format(
      "at {:.0f}, {:.0f}, {:.0f} mm it is outside the mapped field ({:.0f}..{:.0f}, {:.0f}..{:.0f}, {:.0f}..{:.0f} mm)",
      p.x(), p.y(), p.z(), l.x(), h.x(), l.y(), h.y(), l.z(), h.z());
}

}  // namespace birdseye::calibration
