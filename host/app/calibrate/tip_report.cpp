#include "host/app/calibrate/tip_report.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "calibration/base/units.hpp"

namespace birdseye::host {

namespace {

using calibration::Pivot;
using calibration::PivotPose;

constexpr const char* kUsed = "#1b5e9e";
constexpr const char* kOutlier = "#b3261e";

std::string begin_svg(double width, double height) {
  return fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' width='{0}' height='{1}' viewBox='0 0 {0} {1}' role='img' "
      "font-family='DejaVu Sans, sans-serif' font-size='11'><rect width='100%' height='100%' fill='white'/>\n",
      width, height);
}

/// 1, 2 or 5 times a power of ten, so that about `marks` of them make up `range`.
double mark_of(double range, double marks) {
  const double rough = range / marks, unit = std::pow(10, std::floor(std::log10(rough)));
  for (const double times : {1.0, 2.0, 5.0}) {
    if (rough <= times * unit) return times * unit;
  }
  return 10 * unit;
}

std::vector<bool> used_of(const Pivot& pivot) {
  std::vector<bool> used(pivot.residuals_mm.size(), true);
  for (const std::size_t i : pivot.outliers) used[i] = false;
  return used;
}

/// A place for a pose; hollow where it would lie outside of the picture and stands at its edge.
std::string dot(double x, double y, bool used, bool beyond) {
  const char* colour = used ? kUsed : kOutlier;
  return fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='{}' fill='{}' stroke='{}' fill-opacity='0.6'/>", x, y,
                     beyond ? 4 : 2.6, beyond ? "none" : colour, colour);
}

}  // namespace

std::string tip_residuals_svg(const std::vector<PivotPose>& poses, const Pivot& pivot) {
  constexpr double kWidth = 960, kHeight = 260, kLeft = 48, kRight = 10, kTop = 28, kBottom = 34;
  std::string svg = begin_svg(kWidth, kHeight);
  const double most = std::max(1e-9, *std::max_element(pivot.residuals_mm.begin(), pivot.residuals_mm.end()));
  const double high = 1.05 * most, base = kHeight - kBottom;
  const auto count = static_cast<double>(poses.size());
  const double step = (kWidth - kLeft - kRight) / count;
  const auto y = [&](double mm) { return base - (base - kTop) * mm / high; };
  const double mark = mark_of(high, 4);
  for (int k = 0; k * mark <= high; ++k) {
    const double v = k * mark;
    svg +=
        fmt::format("<path d='M{} {:.1f}H{}' stroke='#e4e4e4'/><text x='{}' y='{:.1f}' text-anchor='end'>{:.4g}</text>",
                    kLeft, y(v), kWidth - kRight, kLeft - 5, y(v) + 4, v);
  }
  const auto used = used_of(pivot);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double x = kLeft + step * static_cast<double>(i);
    svg +=
        fmt::format("<rect x='{:.2f}' y='{:.2f}' width='{:.2f}' height='{:.2f}' fill='{}'/>", x + 0.1 * step,
                    y(pivot.residuals_mm[i]), 0.8 * step, base - y(pivot.residuals_mm[i]), used[i] ? kUsed : kOutlier);
    if (pivot.robust.pivots_in_tracker_mm.size() == 1 || (i > 0 && poses[i].divot == poses[i - 1].divot)) continue;
    svg += fmt::format("<path d='M{0:.1f} {1}V{2}' stroke='#888'/><text x='{3:.1f}' y='{4}'>divot {5}</text>", x, kTop,
                       base + 5, x + 2, base + 14, poses[i].divot + 1);
  }
  svg += fmt::format("<path d='M{0} {1:.1f}H{2}' stroke='#444' stroke-dasharray='5 4'/>", kLeft, y(pivot.robust.rms_mm),
                     kWidth - kRight);
  svg += fmt::format(
      "<text x='{}' y='18' fill='#555'>mm; dashed: root mean square of the poses used, {:.2f} mm</text>"
      "<text x='{}' y='{}' text-anchor='middle' fill='#555'>poses, in the order in which they were recorded</text>",
      kLeft, pivot.robust.rms_mm, kWidth / 2, kHeight - 4);
  return svg + "</svg>";
}

std::string tip_cloud_svg(const Pivot& pivot) {
  constexpr double kSide = 320, kMargin = 36;
  constexpr double kHalf = kSide / 2 - kMargin;
  const auto used = used_of(pivot);
  double range_mm = 1e-6;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i]) range_mm = std::max(range_mm, pivot.offsets_mm[i].cwiseAbs().maxCoeff());
  }
  range_mm *= 1.15;
  const double mark = mark_of(2 * range_mm, 5);
  std::string svg = begin_svg(3 * kSide, kSide);
  constexpr std::array<std::array<int, 2>, 3> kViews{{{0, 1}, {0, 2}, {1, 2}}};
  constexpr std::array<char, 3> kNames{'x', 'y', 'z'};
  for (std::size_t n = 0; n < kViews.size(); ++n) {
    const int across = kViews[n][0], up = kViews[n][1];
    svg += fmt::format("<g transform='translate({:.0f} {:.0f})'>", kSide * (static_cast<double>(n) + 0.5), kSide / 2);
    svg += fmt::format("<rect x='{0}' y='{0}' width='{1}' height='{1}' fill='none' stroke='#888'/>", -kHalf, 2 * kHalf);
    const int marks = static_cast<int>(range_mm / mark);
    for (int k = -marks; k <= marks; ++k) {
      const double v = k * mark;
      const double at = v / range_mm * kHalf;
      svg += fmt::format(
          "<path d='M{0:.1f} {1}v{2}M{1} {0:.1f}h{2}' stroke='#ececec'/><text x='{0:.1f}' y='{3}' "
          "text-anchor='middle'>{4:.3g}</text><text x='{5}' y='{6:.1f}' text-anchor='end'>{4:.3g}</text>",
          at, -kHalf, 2 * kHalf, kHalf + 13, std::abs(v) < 1e-9 * range_mm ? 0.0 : v, -kHalf - 4, -at + 4);
    }
    svg += fmt::format("<circle r='{:.1f}' fill='none' stroke='#444' stroke-dasharray='5 4'/>",
                       std::min(1.0, pivot.robust.rms_mm / range_mm) * kHalf);
    for (std::size_t i = 0; i < used.size(); ++i) {
      const Eigen::Vector3d& o = pivot.offsets_mm[i];
      const double x = std::clamp(o[across] / range_mm, -1.0, 1.0), y = std::clamp(o[up] / range_mm, -1.0, 1.0);
      const bool beyond = std::abs(o[across]) > range_mm || std::abs(o[up]) > range_mm;
      svg += dot(x * kHalf, -y * kHalf, used[i], beyond);
    }
    svg += fmt::format("<text x='0' y='{}' text-anchor='middle' fill='#555'>{} right, {} up, mm</text></g>\n",
                       -kHalf - 10, kNames[static_cast<std::size_t>(across)], kNames[static_cast<std::size_t>(up)]);
  }
  return svg + "</svg>";
}

namespace {

/// How far a pose leans from the mean of its divot, as a vector across that mean, degrees.
std::vector<Eigen::Vector2d> leans_of(const std::vector<PivotPose>& poses, const Pivot& pivot) {
  const Eigen::Vector3d& tip_mm = pivot.robust.tip_in_sensor_mm;
  const Eigen::Vector3d shaft = tip_mm.norm() > 0 ? Eigen::Vector3d(tip_mm.normalized()) : Eigen::Vector3d(0, 0, 1);
  const auto used = used_of(pivot);
  std::vector<Eigen::Vector3d> means(pivot.robust.pivots_in_tracker_mm.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (used[i]) means[poses[i].divot] += poses[i].tracker_from_sensor.rotation() * shaft;
  }
  std::vector<Eigen::Vector2d> leans;
  for (const PivotPose& pose : poses) {
    const Eigen::Vector3d mean = means[pose.divot].normalized();
    const Eigen::Vector3d seen = pose.tracker_from_sensor.rotation() * shaft;
    const Eigen::Vector3d x = mean.unitOrthogonal(), y = mean.cross(x);
    const Eigen::Vector2d across(seen.dot(x), seen.dot(y));
    const double angle_deg = std::atan2(across.norm(), seen.dot(mean)) * kDegPerRad;
    leans.emplace_back(across.norm() > 0 ? Eigen::Vector2d(angle_deg * across.normalized()) : Eigen::Vector2d(0, 0));
  }
  return leans;
}

}  // namespace

std::string tilt_coverage_svg(const std::vector<PivotPose>& poses, const Pivot& pivot) {
  constexpr double kSide = 420, kRadius = 180;
  constexpr int kSides = 8;
  constexpr double kLeaning_deg = 10;  // what is less leans nowhere
  const auto leans = leans_of(poses, pivot);
  const auto used = used_of(pivot);
  double range_deg = 2 * kLeaning_deg;
  std::array<bool, kSides> reached{};
  const double sector = 360.0 / kSides * kRadPerDeg;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!used[i]) continue;
    range_deg = std::max(range_deg, 1.05 * leans[i].norm());
    const double turn = std::atan2(leans[i].y(), leans[i].x()) / sector + kSides;
    if (leans[i].norm() >= kLeaning_deg) reached[static_cast<std::size_t>(std::lround(turn)) % kSides] = true;
  }
  std::string svg = begin_svg(kSide, kSide) + fmt::format("<g transform='translate({0} {0})'>", kSide / 2);
  for (int k = 0; k < kSides; ++k) {
    if (reached[static_cast<std::size_t>(k)]) continue;
    const double from = (k - 0.5) * sector, to = (k + 0.5) * sector;
    svg += fmt::format("<path d='M0 0L{:.1f} {:.1f}A{} {} 0 0 0 {:.1f} {:.1f}Z' fill='#f6ddda'/>",
                       kRadius * std::cos(from), -kRadius * std::sin(from), kRadius, kRadius, kRadius * std::cos(to),
                       -kRadius * std::sin(to));
  }
  const int apart_deg = range_deg > 60 ? 20 : 10;
  for (int ring = apart_deg; ring <= range_deg; ring += apart_deg) {
    const double r = kRadius * ring / range_deg;
    svg += fmt::format("<circle r='{:.1f}' fill='none' stroke='#ccc'/><text x='3' y='{:.1f}' fill='#555'>{}°</text>", r,
                       -r - 2, ring);
  }
  svg += fmt::format("<circle r='{}' fill='none' stroke='#888'/>", kRadius);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double length = leans[i].norm(), shown = std::min(1.0, length / range_deg);
    const Eigen::Vector2d at = length > 0 ? Eigen::Vector2d(kRadius * shown / length * leans[i]) : leans[i];
    svg += dot(at.x(), -at.y(), used[i], length > range_deg);
  }
  return svg + "</g></svg>";
}

}  // namespace birdseye::host
