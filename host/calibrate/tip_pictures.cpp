#include "host/calibrate/tip_pictures.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "calibration/base/units.hpp"
#include "host/report/axes.hpp"
#include "host/report/place_views.hpp"
#include "host/report/svg.hpp"

namespace birdseye::host {

namespace {

using calibration::Pivot;
using calibration::PivotPose;

std::vector<bool> used_of(const Pivot& pivot) {
  std::vector<bool> used(pivot.residuals_mm.size(), true);
  for (const std::size_t i : pivot.outliers) used[i] = false;
  return used;
}

/// A place for a pose; hollow where it would lie outside of the picture and stands at its edge.
std::string dot(double x, double y, bool used, bool beyond) {
  const char* colour = used ? kBlue : kRed;
  return fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='{}' fill='{}' stroke='{}' fill-opacity='0.6'/>", x, y,
                     beyond ? 4 : 2.6, beyond ? "none" : colour, colour);
}

}  // namespace

std::string tip_residuals_svg(const std::vector<PivotPose>& poses, const Pivot& pivot) {
  constexpr double kWidth = 960, kHeight = 280, kTop = 30;
  constexpr double kShown = 8;  // times the root mean square
  const double worst = std::max(1e-9, *std::max_element(pivot.residuals_mm.begin(), pivot.residuals_mm.end()));
  const double most = std::min(worst, kShown * std::max(pivot.robust.rms_mm, 1e-9));
  const auto count = static_cast<double>(poses.size());
  const Axes axes({Axes::kLeft, kTop, kWidth - Axes::kLeft - 10, kHeight - kTop - Axes::kBelow},
                  {{0, count}, "pose, in the order in which they were recorded", 10},
                  {{0, 1.05 * most}, "distance, mm"});
  std::string svg = axes.svg();
  const double bottom = axes.y_of(0);
  const auto used = used_of(pivot);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double x = axes.x_of(static_cast<double>(i)), step = axes.x_of(1) - axes.x_of(0);
    const double top = axes.y_of(std::min(pivot.residuals_mm[i], 1.05 * most));
    svg += fmt::format("<rect x='{:.2f}' y='{:.2f}' width='{:.2f}' height='{:.2f}' fill='{}'/>", x + 0.1 * step, top,
                       0.8 * step, bottom - top, used[i] ? kBlue : kRed);
    if (pivot.robust.pivots_in_tracker_mm.size() == 1 || (i > 0 && poses[i].divot == poses[i - 1].divot)) continue;
    svg += svg_line(x, kTop - 4, x, bottom, kGrey) +
           svg_text(x + 3, kTop - 1, fmt::format("divot {}", poses[i].divot + 1), Anchor::start, kGrey);
  }
  const double rms = axes.y_of(pivot.robust.rms_mm);
  svg += svg_line(axes.area().left, rms, axes.area().left + axes.area().width, rms, kInk, kDashed);
  svg += svg_text(axes.area().left, 14,
                  fmt::format("dashed: root mean square of the poses used, {:.2f} mm{}", pivot.robust.rms_mm,
                              most < worst ? fmt::format("; bars are cut above, the longest is {:.3g} mm", worst) : ""),
                  Anchor::start, kGrey);
  return svg_picture(kWidth, kHeight, svg);
}

std::string tip_cloud_svg(const Pivot& pivot) {
  constexpr double kSide = 250, kBetween = 8, kTop = 10;
  const auto used = used_of(pivot);
  double range_mm = 1e-6;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i]) range_mm = std::max(range_mm, pivot.offsets_mm[i].cwiseAbs().maxCoeff());
  }
  range_mm *= 1.15;
  std::string svg;
  constexpr std::array<std::array<int, 2>, 3> kViews{{{0, 1}, {0, 2}, {1, 2}}};
  constexpr std::array<char, 3> kNames{'x', 'y', 'z'};
  constexpr double kPanel = Axes::kLeft + kSide + kBetween;
  for (std::size_t n = 0; n < kViews.size(); ++n) {
    const int across = kViews[n][0], up = kViews[n][1];
    const auto axis = [&](int which) {
      return Axis{{-range_mm, range_mm}, fmt::format("{}, mm", kNames[static_cast<std::size_t>(which)]), 5};
    };
    const Axes axes({kPanel * static_cast<double>(n) + Axes::kLeft, kTop, kSide, kSide}, axis(across), axis(up));
    svg += axes.svg();
    svg += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='{:.1f}' fill='none' stroke='{}' {}/>", axes.x_of(0),
                       axes.y_of(0), std::min(1.0, pivot.robust.rms_mm / range_mm) * kSide / 2, kInk, kDashed);
    for (std::size_t i = 0; i < used.size(); ++i) {
      const Eigen::Vector3d& o = pivot.offsets_mm[i];
      const bool beyond = std::abs(o[across]) > range_mm || std::abs(o[up]) > range_mm;
      svg += dot(axes.x_of(std::clamp(o[across], -range_mm, range_mm)),
                 axes.y_of(std::clamp(o[up], -range_mm, range_mm)), used[i], beyond);
    }
  }
  return svg_picture(3 * kPanel, kTop + kSide + Axes::kBelow, svg);
}

std::string tip_places_svg(const std::vector<PivotPose>& poses, const Pivot& pivot) {
  constexpr std::size_t kMost = 600;
  PlaceViews views;
  const auto used = used_of(pivot);
  const std::size_t step = poses.size() / kMost + 1;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (i % step != 0 && used[i]) continue;
    views.marks.push_back(
        {poses[i].tracker_from_sensor.translation() - pivot.robust.pivots_in_tracker_mm[poses[i].divot],
         Eigen::Vector3d::Zero(), used[i] ? kBlue : kRed, used[i] ? PlaceShape::dot : PlaceShape::cross});
  }
  views.marks.push_back({Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), kInk, PlaceShape::ring, "tip"});
  views.radius_mm = pivot.robust.tip_in_sensor_mm.norm();
  return place_views_svg(views, 1);
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
  std::string svg = fmt::format("<g transform='translate({0} {0})'>", kSide / 2);
  for (int k = 0; k < kSides; ++k) {
    if (reached[static_cast<std::size_t>(k)]) continue;
    const double from = (k - 0.5) * sector, to = (k + 0.5) * sector;
    svg += fmt::format("<path d='M0 0L{:.1f} {:.1f}A{} {} 0 0 0 {:.1f} {:.1f}Z' fill='#f6ddda'/>",
                       kRadius * std::cos(from), -kRadius * std::sin(from), kRadius, kRadius, kRadius * std::cos(to),
                       -kRadius * std::sin(to));
  }
  const int apart_deg = range_deg > 60 ? 20 : 10;
  svg += rings_svg(0, 0, kRadius, range_deg, apart_deg);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double length = leans[i].norm(), shown = std::min(1.0, length / range_deg);
    const Eigen::Vector2d at = length > 0 ? Eigen::Vector2d(kRadius * shown / length * leans[i]) : leans[i];
    svg += dot(at.x(), -at.y(), used[i], length > range_deg);
  }
  return svg_picture(kSide, kSide, svg + "</g>");
}

}  // namespace birdseye::host
