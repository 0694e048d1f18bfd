#include "hw-sim/case/shaped_moves.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d mean_vertex(const Mesh& mesh) {
  Vector3d sum = Vector3d::Zero();
  for (const Eigen::Vector3f& v : mesh.vertices) sum += v.cast<double>();
  return sum / static_cast<double>(mesh.vertices.size());
}

/// The direction in which the surface reaches furthest about its middle.
Vector3d longest_axis(const Mesh& mesh, const Vector3d& middle) {
  Matrix3d spread = Matrix3d::Zero();
  for (const Eigen::Vector3f& v : mesh.vertices) {
    const Vector3d from = v.cast<double>() - middle;
    spread += from * from.transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Matrix3d>(spread).eigenvectors().col(2);
}

/// What an organ takes up along an axis.
struct Span {
  double low_mm = std::numeric_limits<double>::max(), high_mm = std::numeric_limits<double>::lowest();
  [[nodiscard]] double middle_mm() const { return 0.5 * (low_mm + high_mm); }
  [[nodiscard]] double half_mm() const { return 0.5 * (high_mm - low_mm); }
};

Span span_along(const Mesh& mesh, const Vector3d& axis) {
  Span span;
  for (const Eigen::Vector3f& v : mesh.vertices) {
    const double along = v.cast<double>().dot(axis);
    span.low_mm = std::min(span.low_mm, along);
    span.high_mm = std::max(span.high_mm, along);
  }
  return span;
}

/// From 0 to 1 about 0, over about four times the width.
double rise(double past, double width) {
  return 0.5 * (1 + std::tanh(past / width));
}

DrawnNumber number(const char* name, double value) {
  return {name, {value}};
}

DrawnNumber number(const char* name, const Vector3d& v) {
  return {name, {v.x(), v.y(), v.z()}};
}

}  // namespace

DrawnMove bend(const OrganShape& organ, Draw& draw) {
  const Vector3d mean = mean_vertex(organ.surface);
  const Vector3d along = draw.about(longest_axis(organ.surface, mean), 20 * kRadPerDeg);
  const Vector3d axis = along.cross(draw.direction()).normalized();
  const Vector3d towards = axis.cross(along);
  const double half_mm = span_along(organ.surface, along).half_mm();
  const Vector3d middle = mean + draw.uniform(-0.3, 0.3) * half_mm * along;
  const auto move = [=](const Vector3d& rest, double size_mm) -> Vector3d {
    const double curvature = 2 * size_mm / (half_mm * half_mm);
    const double s = (rest - middle).dot(along);
    const double t = (rest - middle).dot(towards);
    // On an arc of radius 1 / curvature, whose centre lies towards t.
    const double half_turn = 0.5 * curvature * s;
    const double sagitta = half_turn == 0 ? 0 : s * std::sin(half_turn) * std::sin(half_turn) / half_turn;
    const double chord = half_turn == 0 ? s : s * std::sin(2 * half_turn) / (2 * half_turn);
    return (chord - s - t * std::sin(2 * half_turn)) * along +
           (sagitta - 2 * t * std::sin(half_turn) * std::sin(half_turn)) * towards;
  };
  return {move, {number("axis", axis), number("along", along), number("middle_mm", middle)}};
}

DrawnMove push(const OrganShape& organ, double width_mm, Draw& draw) {
  constexpr double kFacing = 0.3;
  constexpr int kTries = 200;
  const Mesh& mesh = organ.surface;
  std::size_t v = draw.index(mesh.vertices.size());
  for (int i = 0; i < kTries && mesh.normals[v].cast<double>().dot(organ.towards_scope) < kFacing; ++i)
    v = draw.index(mesh.vertices.size());
  const Vector3d tip = mesh.vertices[v].cast<double>();
  const Vector3d inwards = -mesh.normals[v].cast<double>().normalized();
  const double across_mm = width_mm / (2 * std::sqrt(2 * std::numbers::ln2));
  const double deep_mm = width_mm;
  const auto move = [=](const Vector3d& rest, double size_mm) -> Vector3d {
    const double depth = (rest - tip).dot(inwards);
    const double aside2 = (rest - tip - depth * inwards).squaredNorm();
    return size_mm * std::exp(-0.5 * (aside2 / (across_mm * across_mm) + depth * depth / (deep_mm * deep_mm))) *
           inwards;
  };
  return {move, {number("tip_mm", tip), number("direction", inwards), number("width_mm", width_mm)}};
}

DrawnMove compression(const OrganShape& organ, Draw& draw) {
  const Vector3d axis = draw.direction();
  const double half_mm = span_along(organ.surface, axis).half_mm();
  const Vector3d middle = mean_vertex(organ.surface) + draw.uniform(-0.3, 0.3) * half_mm * axis;
  const double width_mm = 0.6 * half_mm;
  const auto move = [=](const Vector3d& rest, double size_mm) -> Vector3d {
    const double most_mm = width_mm * std::sqrt(std::numbers::pi / 2);  // by which it would shorten, pressed flat
    const double share = size_mm / most_mm;
    const double s = (rest - middle).dot(axis);
    const double left = std::max(0.05, 1 - share * std::exp(-0.5 * s * s / (width_mm * width_mm)));
    const Vector3d aside = rest - middle - s * axis;
    return -share * most_mm * std::erf(s / (width_mm * std::numbers::sqrt2)) * axis + (1 / std::sqrt(left) - 1) * aside;
  };
  return {move, {number("axis", axis), number("middle_mm", middle)}};
}

DrawnMove twist(const OrganShape& organ, Draw& draw) {
  const Vector3d axis = draw.direction();
  const Vector3d middle = mean_vertex(organ.surface);
  const Span span = span_along(organ.surface, axis);
  double radius_mm = 0;
  for (const Eigen::Vector3f& v : organ.surface.vertices)
    radius_mm = std::max(radius_mm, (v.cast<double>() - middle).cross(axis).norm());
  const double still_mm = span.low_mm + draw.uniform(0, 0.5) * 2 * span.half_mm();
  const auto move = [=](const Vector3d& rest, double size_mm) -> Vector3d {
    const double turn_rad = size_mm / radius_mm * (rest.dot(axis) - still_mm) / (span.high_mm - still_mm);
    return rotation_exp(turn_rad * axis) * (rest - middle) - (rest - middle);
  };
  return {move, {number("axis", axis), number("middle_mm", middle), number("still_at_mm", still_mm)}};
}

DrawnMove breathing(const OrganShape& organ, Draw& draw) {
  const Mesh& mesh = organ.surface;
  const Span x = span_along(mesh, Vector3d::UnitX());
  const Span y = span_along(mesh, Vector3d::UnitY());
  const Span z = span_along(mesh, Vector3d::UnitZ());
  const double lower_end = draw.uniform(0.3, 0.6);
  const double left = draw.uniform(-0.3, 0);  // the right dome comes down further
  const double back = draw.uniform(-0.1, 0.25);
  const double forward = draw.uniform(0, 0.25);
  const auto move = [=](const Vector3d& rest, double size_mm) -> Vector3d {
    const double share = lower_end + (1 - lower_end) * rise(rest.z() - z.middle_mm(), 0.6 * z.half_mm());
    const double shear = 1 + left * std::tanh((rest.x() - x.middle_mm()) / x.half_mm()) +
                         back * std::tanh((rest.y() - y.middle_mm()) / y.half_mm());
    return size_mm * share * Vector3d(0, -forward, -shear);
  };
  return {move,
          {number("lower_end_share", lower_end), number("left_share", left), number("back_share", back),
           number("forward_share", forward)}};
}

DrawnMove pneumoperitoneum(const OrganShape& organ, Draw& draw) {
  const Mesh& mesh = organ.surface;
  const Vector3d front = draw.about(-Vector3d::UnitY(), 15 * kRadPerDeg);
  const Vector3d side = (Vector3d::UnitX() - front.x() * front).normalized();
  const Vector3d tall = side.cross(front);
  const Span depth = span_along(mesh, front);
  const Span width = span_along(mesh, side);
  const Span height = span_along(mesh, tall);
  const double spread = draw.uniform(0.25, 0.5);
  const auto move = [=](const Vector3d& rest, double size_mm) -> Vector3d {
    const double w = (rest.dot(side) - width.middle_mm()) / width.half_mm();
    const double h = (rest.dot(tall) - height.middle_mm()) / height.half_mm();
    const double fore = rise(rest.dot(front) - depth.middle_mm() - 0.2 * depth.half_mm(), 0.7 * depth.half_mm());
    const Vector3d pressed = -fore * std::exp(-0.6 * (w * w + h * h)) * front;
    const Vector3d spreads = spread * (0.4 + 0.6 * fore) * (std::tanh(w) * side + 0.5 * std::tanh(h) * tall);
    return size_mm * (pressed + spreads);
  };
  return {move, {number("front", front), number("spread_share", spread)}};
}

}  // namespace birdseye::hw_sim
