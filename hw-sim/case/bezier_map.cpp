#include "hw-sim/case/bezier_map.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "hw-sim/base/hashed.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The inner Bernstein polynomials of one axis at t, and their derivatives by t.
struct Basis {
  std::array<double, BezierMap::kMostInner> value{}, slope{};
};

Basis inner_bernstein(int inner, double t) {
  const int degree = inner + 1;
  // Those of one degree less, by the recurrence that raises the degree.
  std::array<double, BezierMap::kMostInner + 2> less{};
  less[0] = 1;
  for (int n = 1; n < degree; ++n) {
    for (int i = n; i > 0; --i) {
      const auto at = static_cast<std::size_t>(i);
      less[at] = (1 - t) * less[at] + t * less[at - 1];
    }
    less[0] *= 1 - t;
  }
  Basis basis;
  for (std::size_t i = 0; i < static_cast<std::size_t>(inner); ++i) {
    basis.value[i] = (1 - t) * less[i + 1] + t * less[i];
    basis.slope[i] = degree * (less[i] - less[i + 1]);
  }
  return basis;
}

}  // namespace

BezierMap::BezierMap(const Vector3d& low_mm, const Vector3d& high_mm, const std::array<int, 3>& inner)
    : TissueMap(low_mm, high_mm), inner_(inner) {
  std::size_t points = 1;
  for (const int n : inner) points *= static_cast<std::size_t>(n);
  control_mm_.assign(points, Vector3d::Zero());
}

Result<BezierMap> BezierMap::random(const BezierMap& still, double amplitude_mm,
                                    std::span<const Eigen::Vector3f> organ_at_rest_mm, std::uint64_t seed) {
  constexpr int kDraws = 20, kScalings = 12;
  constexpr double kCloseEnough = 1e-4;
  constexpr std::size_t kPoints = 2000;
  if (amplitude_mm == 0) return still;
  const std::size_t every = std::max<std::size_t>(1, organ_at_rest_mm.size() / kPoints);
  const auto furthest_mm = [&](const BezierMap& map) {
    double most = 0;
    for (std::size_t i = 0; i < organ_at_rest_mm.size(); i += every) {
      const Vector3d p = organ_at_rest_mm[i].cast<double>();
      most = std::max(most, (map.deformed_of(p) - p).norm());
    }
    return most;
  };
  std::uint64_t key = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    BezierMap map = still;
    for (Vector3d& d : map.control_mm_) {
      for (int axis = 0; axis < 3; ++axis) d[axis] = hashed_normal(seed + 61, key++);
    }
    // The displacement of a point at rest is not linear in the control points', but nearly: scale until it fits.
    for (int scaling = 0; scaling < kScalings && map.least_determinant() > kLeastDeterminant; ++scaling) {
      const double most = furthest_mm(map);
      if (std::abs(most / amplitude_mm - 1) < kCloseEnough) return map;
      for (Vector3d& d : map.control_mm_) d *= amplitude_mm / most;
    }
  }
  return Error{Errc::bad_value, fmt::format("--amplitude-mm {:g}: {}x{}x{} control points that move the organ so far "
                                            "fold its tissue; give less, or fewer of them with --dof",
                                            amplitude_mm, still.inner_[0], still.inner_[1], still.inner_[2])};
}

bool BezierMap::holds(const Vector3d& point_mm) const {
  return (point_mm - low_mm()).minCoeff() >= 0 && (high_mm() - point_mm).minCoeff() >= 0;
}

Vector3d BezierMap::displacement_mm(const Vector3d& deformed_mm) const {
  if (!holds(deformed_mm)) return Vector3d::Zero();
  const Vector3d t = (deformed_mm - low_mm()).cwiseQuotient(high_mm() - low_mm());
  const Basis x = inner_bernstein(inner_[0], t.x());
  const Basis y = inner_bernstein(inner_[1], t.y());
  const Basis z = inner_bernstein(inner_[2], t.z());
  Vector3d u = Vector3d::Zero();
  std::size_t at = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(inner_[2]); ++k) {
    for (std::size_t j = 0; j < static_cast<std::size_t>(inner_[1]); ++j) {
      for (std::size_t i = 0; i < static_cast<std::size_t>(inner_[0]); ++i, ++at)
        u += x.value[i] * y.value[j] * z.value[k] * control_mm_[at];
    }
  }
  return u;
}

Matrix3d BezierMap::jacobian(const Vector3d& deformed_mm) const {
  Matrix3d out = Matrix3d::Identity();
  if (!holds(deformed_mm)) return out;
  const Vector3d extent = high_mm() - low_mm();
  const Vector3d t = (deformed_mm - low_mm()).cwiseQuotient(extent);
  const Basis x = inner_bernstein(inner_[0], t.x());
  const Basis y = inner_bernstein(inner_[1], t.y());
  const Basis z = inner_bernstein(inner_[2], t.z());
  std::size_t at = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(inner_[2]); ++k) {
    for (std::size_t j = 0; j < static_cast<std::size_t>(inner_[1]); ++j) {
      for (std::size_t i = 0; i < static_cast<std::size_t>(inner_[0]); ++i, ++at) {
        const Vector3d slope(x.slope[i] * y.value[j] * z.value[k], x.value[i] * y.slope[j] * z.value[k],
                             x.value[i] * y.value[j] * z.slope[k]);
        out += control_mm_[at] * slope.cwiseQuotient(extent).transpose();
      }
    }
  }
  return out;
}

Vector3d BezierMap::deformed_of(const Vector3d& rest_mm) const {
  if (!holds(rest_mm)) return rest_mm;
  constexpr double kTolerance_mm = 1e-9;
  constexpr int kSteps = 60, kHalvings = 10;
  Vector3d x = rest_mm;
  Vector3d residual = rest_of(x) - rest_mm;
  for (int step = 0; step < kSteps && residual.norm() > kTolerance_mm; ++step) {
    const Vector3d newton = jacobian(x).partialPivLu().solve(residual);
    // Halved until it helps, and kept in the box, which the map takes onto itself.
    double share = 1;
    for (int halving = 0; halving < kHalvings; ++halving, share *= 0.5) {
      const Vector3d next = (x - share * newton).cwiseMax(low_mm()).cwiseMin(high_mm());
      const Vector3d left = rest_of(next) - rest_mm;
      if (left.norm() >= residual.norm()) continue;
      x = next;
      residual = left;
      break;
    }
  }
  return x;
}

double BezierMap::least_determinant() const {
  constexpr int kPoints = 33;
  return least_over_lattice(low_mm(), high_mm(), kPoints,
                            [this](const Vector3d& p) { return jacobian(p).determinant(); });
}

}  // namespace birdseye::hw_sim
