#include "host/registration/geometry/surface_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "calibration/base/median.hpp"
#include "calibration/picture/picture_mat.hpp"
#include "host/registration/geometry/outlines.hpp"
#include "host/registration/similarity/overlap_mask.hpp"

namespace birdseye::host {

namespace {

constexpr double kMost_mm = 10;               ///< how far off a place is looked for
constexpr double kChance = 0.01;              ///< of a false alarm, a check
constexpr std::size_t kManyPatches = 40;      ///< of which a shift is always found where nothing has moved
constexpr std::size_t kLeastOutline = 30;     ///< places by which alone it can be told
constexpr std::size_t kLeastOutlinePart = 8;  ///< places of one part
constexpr double kMostBound_mm = 5;           ///< a motion that none of the figures would show is not ruled out

/// A figure that is nearly zero where nothing has moved.
struct Test {
  int part;
  double figure_mm;
  double sigma_mm;    ///< of the figure or, for a length, each of its axes
  int axes;           ///< 1: a number or its size; 2: a length in the picture
  double scatter_mm;  ///< what the figure is without any of these errors
  double bound_mm = 0;
};

/// Exceeded by none of so many figures in 99 of 100 checks.
double bound_mm(const Test& test, std::size_t tests) {
  const double chance = kChance / static_cast<double>(tests);
  if (test.axes == 2) return test.scatter_mm + std::sqrt(-2 * std::log(chance)) * test.sigma_mm;
  // P(|normal| > z) = erfc(z / sqrt(2)), by bisection.
  double low = 0, high = 10;
  for (int i = 0; i < 50; ++i) {
    const double z = (low + high) / 2;
    (std::erfc(z / std::numbers::sqrt2) > chance ? low : high) = z;
  }
  return test.scatter_mm + high * test.sigma_mm;
}

std::vector<Test> tests_of_texture(const CheckedPlaces& places, const CheckErrors& errors) {
  constexpr double kOwn_mm = 0.15;  ///< of a part's shift, each axis (docs/manual/registration.md)
  std::vector<Test> out;
  for (const TextureShift& texture : places.texture) {
    if (!texture.shift_mm) continue;
    const double sigma_mm = std::hypot(kOwn_mm, errors.pose_mm, errors.surface_mm * texture.per_surface_mm);
    out.push_back({texture.part, texture.shift_mm->norm(), sigma_mm, 2, 0});
  }
  return out;
}

std::vector<Test> tests_of_outline(const CheckedPlaces& places, const CheckErrors& errors) {
  constexpr double kOwn_mm = 0.3, kTogether = 4;  ///< neighbours that err alike
  constexpr double kOfMedian = 1.2533, kHalfAreBelow = 0.6745;
  std::vector<Test> out;
  for (int part = 0; part < kPictureParts; ++part) {
    std::vector<double> signed_mm, sizes_mm;
    for (const OutlineShift& shift : places.outline) {
      if (part != kWholePicture && part != part_of(shift.at_px.x(), shift.at_px.y(), places.width_px, places.height_px))
        continue;
      signed_mm.push_back(shift.outwards_mm);
      sizes_mm.push_back(std::abs(shift.outwards_mm));
    }
    if (signed_mm.size() < kLeastOutlinePart) continue;
    const double own_mm = kOfMedian * kOwn_mm / std::sqrt(static_cast<double>(signed_mm.size()) / kTogether);
    const double sigma_mm = std::hypot(own_mm, errors.pose_mm, errors.surface_mm);
    out.push_back({part, std::abs(median_of(std::move(signed_mm))), sigma_mm, 1, 0});
    out.push_back({part, median_of(std::move(sizes_mm)), sigma_mm, 1, kHalfAreBelow * kOwn_mm});
  }
  return out;
}

/// Of the figure that shows the smallest motion.
double least_bound_mm(const std::vector<Test>& tests) {
  double out = std::numeric_limits<double>::infinity();
  for (const Test& test : tests) out = std::min(out, test.bound_mm);
  return out;
}

std::string where(int part) {
  constexpr std::array<const char*, kPictureParts> kNames{
      "in the upper left", "at the top",        "in the upper right", "at the left",        "in the middle",
      "at the right",      "in the lower left", "at the bottom",      "in the lower right", "all over the picture"};
  return kNames[static_cast<std::size_t>(part)];
}

}  // namespace

Result<PinholeView> view_to_check(const CameraModel& camera, const Transform<Camera, Patient>& camera_from_patient,
                                  const RgbView& picture) {
  if (!picture.whole() || picture.width_px != camera.width_px || picture.height_px != camera.height_px) {
    return Error{Errc::bad_value, fmt::format("a picture of {}x{} is not of the camera's {}x{} pixels",
                                              picture.width_px, picture.height_px, camera.width_px, camera.height_px)};
  }
  constexpr int kWidth_px = 640;
  const int times = std::max(1, camera.width_px / kWidth_px);
  VideoView view;
  view.camera = camera;
  view.camera_from_patient = camera_from_patient;
  view.camera.width_px /= times;
  view.camera.height_px /= times;
  view.camera.fx_px /= times;
  view.camera.fy_px /= times;
  view.camera.cx_px = (camera.cx_px + 0.5) / times - 0.5;
  view.camera.cy_px = (camera.cy_px + 0.5) / times - 0.5;
  const cv::Mat whole = mat_of(picture)(cv::Rect(0, 0, times * view.camera.width_px, times * view.camera.height_px));
  cv::Mat small;
  cv::resize(whole, small, {view.camera.width_px, view.camera.height_px}, 0, 0, cv::INTER_AREA);
  const RgbView pixels{{small.data, small.total() * small.elemSize()}, small.cols, small.rows};
  auto mask = overlap_mask(pixels);
  if (!mask) return mask.error();
  view.mask = *std::move(mask);
  return pinhole_view(view, pixels);
}

SurfaceFinding judge(const CheckedPlaces& places, const CheckErrors& errors) {
  SurfaceFinding out;
  std::vector<Test> tests = tests_of_texture(places, errors);
  const bool texture_told = !tests.empty();
  for (const Test& test : tests_of_outline(places, errors)) tests.push_back(test);
  for (const TextureShift& texture : places.texture) {
    if (texture.part == kWholePicture) out.places += static_cast<std::size_t>(texture.places);
  }
  const std::size_t patches = out.places;
  out.places += places.outline.size();
  const Test* worst = nullptr;
  for (Test& test : tests) {
    test.bound_mm = bound_mm(test, tests.size());
    if (worst == nullptr || test.figure_mm / test.bound_mm > worst->figure_mm / worst->bound_mm) worst = &test;
  }
  if (worst != nullptr) {
    out.figure_mm = worst->figure_mm;
    out.bound_mm = worst->bound_mm;
    out.words = fmt::format("{:.1f} mm off {}, where up to {:.1f} mm may be chance", worst->figure_mm,
                            where(worst->part), worst->bound_mm);
    if (worst->figure_mm > worst->bound_mm) {
      out.verdict = SurfaceVerdict::moved;
      return out;
    }
  }
  if (!texture_told && patches >= kManyPatches) {
    out.words = "nothing of what the kept views show is found again: smoke, an instrument, or the organ has moved far";
  } else if (!texture_told && places.outline.size() < kLeastOutline) {
    out.words = "too little of the organ is seen here that a kept view shows too, and too little of its outline";
  } else if (const double least_mm = least_bound_mm(tests); least_mm > kMostBound_mm) {
    out.words =
        fmt::format("poses and surface are known so little that a motion under {:.0f} mm would not show", least_mm);
  } else {
    out.verdict = SurfaceVerdict::holds;
    return out;
  }
  out.figure_mm.reset();
  out.bound_mm.reset();
  return out;
}

SurfaceCheck::SurfaceCheck(SignedDistance organ, std::vector<PinholeView> kept) : surface_(std::move(organ)) {
  for (PinholeView& view : kept) kept_.push_back(earlier_view(std::move(view), surface_));
}

CheckedPlaces SurfaceCheck::places(const PinholeView& now) const {
  CheckedPlaces out{now.width_px, now.height_px, texture_shifts(kept_, now, surface_, kMost_mm), {}};
  for (const SeenPoint& point : outline_points({now}, surface_, kMost_mm)) {
    const auto pixel = now.project(point.place_mm);
    out.outline.push_back({{pixel.x_px, pixel.y_px}, surface_.distance().distance_mm(point.place_mm)});
  }
  return out;
}

}  // namespace birdseye::host
