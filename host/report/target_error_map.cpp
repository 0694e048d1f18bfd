#include "host/report/target_error_map.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "host/report/even_colours.hpp"
#include "host/report/slice_picture.hpp"

namespace birdseye::host {

namespace {

using Eigen::Vector3d;

constexpr int kSide_px = 480;
constexpr double kBad_mm = 5;  // from here on the tint is the brightest
constexpr Colour kFiducial{120, 200, 255}, kTarget{255, 255, 255}, kLine{255, 255, 255};

/// A round step that puts some six lines between the least and the most.
double step_of(double least_mm, double most_mm) {
  for (const double step : {0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0}) {
    if ((most_mm - least_mm) / step <= 7) return step;
  }
  return 10;
}

void draw_lines(Picture& picture, const std::vector<double>& tre_mm) {
  const auto [least, most] = std::minmax_element(tre_mm.begin(), tre_mm.end());
  const double step = step_of(*least, *most);
  const auto index = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width_px) + static_cast<std::size_t>(x);
  };
  const auto band = [&](int x, int y) { return static_cast<int>(tre_mm[index(x, y)] / step); };
  for (int y = 0; y + 1 < picture.height_px; ++y) {
    for (int x = 0; x + 1 < picture.width_px; ++x) {
      if (band(x, y) == band(x + 1, y) && band(x, y) == band(x, y + 1)) continue;
      std::copy(kLine.begin(), kLine.end(), &picture.rgb[3 * index(x, y)]);
    }
  }
  // Along both diagonals, where the names of the lines are out of one another's way.
  for (const bool down : {true, false}) {
    for (int i = 8; i + 40 < picture.width_px; ++i) {
      const int y = down ? i : picture.height_px - 1 - i;
      const int next = down ? y + 1 : y - 1;
      const int here = band(i, y);
      const int there = band(i + 1, next);
      const bool in_the_way = y < 28 || std::abs(i - picture.width_px / 2) < 40;  // of the title, of the target
      if (here != there && !in_the_way)
        draw_text(picture, {i + 3.0, y + (down ? -3.0 : 12.0)}, fmt::format("{:g}", step * std::max(here, there)),
                  kLine);
    }
  }
}

}  // namespace

Picture draw_target_error(const calibration::TargetError& error, const TargetErrorScene& scene) {
  const Vector3d centre = scene.targets_mm.empty() ? error.centroid_mm() : scene.targets_mm.front();
  double reach_mm = 60;
  for (const auto points : {scene.fiducials_mm, scene.targets_mm}) {
    for (const Vector3d& p : points) reach_mm = std::max(reach_mm, (p - centre).cwiseAbs().maxCoeff() + 20);
  }
  std::vector<Picture> slices;
  for (const auto& [kind, name] :
       {std::pair{SliceKind::axial, "axial"}, {SliceKind::coronal, "coronal"}, {SliceKind::sagittal, "sagittal"}}) {
    const SlicePlane plane = slice_plane(kind, centre, 2 * reach_mm, kSide_px, kSide_px);
    Picture slice{kSide_px, kSide_px, std::vector<std::uint8_t>(std::size_t{3} * kSide_px * kSide_px, 40)};
    if (scene.ct != nullptr) slice = draw_slice(*scene.ct, plane, -200, 400);
    std::vector<double> tre_mm;
    for (int y = 0; y < kSide_px; ++y) {
      for (int x = 0; x < kSide_px; ++x) {
        tre_mm.push_back(error.rms_mm(plane.at(x + 0.5, y + 0.5)));
        const Colour tint = even_colour(tre_mm.back() / kBad_mm);
        std::uint8_t* rgb = &slice.rgb[3 * (tre_mm.size() - 1)];
        for (int c = 0; c < 3; ++c)
          rgb[c] = static_cast<std::uint8_t>(0.65 * rgb[c] + 0.35 * tint[static_cast<std::size_t>(c)]);
      }
    }
    draw_lines(slice, tre_mm);
    for (std::size_t i = 0; i < scene.fiducials_mm.size(); ++i) {
      const Eigen::Vector2d at = plane.px_of(scene.fiducials_mm[i]);
      draw_circle(slice, at);
      draw_text(slice, at + Eigen::Vector2d(-4, 5), std::to_string(i + 1), kFiducial);
    }
    for (std::size_t i = 0; i < scene.targets_mm.size(); ++i) {
      const Eigen::Vector2d at = plane.px_of(scene.targets_mm[i]);
      draw_cross_hair(slice, at, 12, kTarget);
      draw_text(slice, at + Eigen::Vector2d(8, -8),
                fmt::format("target {}: {:.2f} mm", i + 1, error.rms_mm(scene.targets_mm[i])), kTarget);
    }
    draw_text(slice, {8, 18}, fmt::format("{}: predicted error, mm rms", name), kLine);
    slices.push_back(std::move(slice));
  }
  return tile(slices, 3, 1);
}

std::optional<TargetErrorRange> target_error_range(const calibration::TargetError& error, const Volume& ct) {
  constexpr std::int16_t kTissue_hu = -300;
  constexpr int kEvery = 3;  // voxels, along each axis: the error varies over centimetres
  std::vector<double> tre_mm;
  for (int k = 0; k < ct.size[2]; k += kEvery) {
    for (int j = 0; j < ct.size[1]; j += kEvery) {
      for (int i = 0; i < ct.size[0]; i += kEvery) {
        if (ct.at(i, j, k) > kTissue_hu) tre_mm.push_back(error.rms_mm(ct.patient_from_voxel * Vector3d(i, j, k)));
      }
    }
  }
  if (tre_mm.empty()) return std::nullopt;
  std::sort(tre_mm.begin(), tre_mm.end());
  return TargetErrorRange{tre_mm.front(), tre_mm[tre_mm.size() / 2], tre_mm[tre_mm.size() * 95 / 100], tre_mm.back()};
}

}  // namespace birdseye::host
