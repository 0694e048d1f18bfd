#include "host/overlay/margins.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "host/volume/signed_distance.hpp"

namespace birdseye::host {

namespace {

constexpr double kSpacing_mm = 1;
// Of 255: what of the video a shell's inside hides.
constexpr int kFill = 34;

/// Of each grid point near the shell the nearest place of it.
MarginShell shell_at(double margin_mm, const SignedDistance& distance) {
  MarginShell shell{margin_mm, {}};
  const double at_mm = margin_mm - kMarginDisc_mm;
  const auto& points = distance.points();
  for (int k = 0; k < points[2]; ++k) {
    for (int j = 0; j < points[1]; ++j) {
      for (int i = 0; i < points[0]; ++i) {
        Eigen::Vector3d place_mm = distance.patient_from_box() * (distance.spacing_mm() * Eigen::Vector3d(i, j, k));
        const auto sample = distance.sample(place_mm);
        const double slope = sample.gradient.squaredNorm();
        if (std::abs(sample.distance_mm - at_mm) > 0.5 * kSpacing_mm || !(slope > 0.25)) continue;
        place_mm -= (sample.distance_mm - at_mm) / slope * sample.gradient;
        shell.places_mm.push_back(place_mm);
      }
    }
  }
  return shell;
}

/// White where the shell covers the picture.
cv::Mat silhouette_of(const MarginShell& shell, const CameraModel& camera,
                      const Transform<Camera, Patient>& camera_from_patient) {
  cv::Mat mask(camera.height_px, camera.width_px, CV_8U, cv::Scalar(0));
  constexpr int kFraction = 4;  // bits of a pixel that OpenCV draws to
  constexpr double kNear_mm = 2, kWhole = 1 << kFraction;
  for (const Eigen::Vector3d& place_mm : shell.places_mm) {
    const Eigen::Vector3d in_camera_mm = camera_from_patient * place_mm;
    if (in_camera_mm.z() < kNear_mm) continue;
    const auto at_px = project(camera, in_camera_mm);
    if (!at_px || at_px->cwiseAbs().maxCoeff() > 2.0 * (camera.width_px + camera.height_px)) continue;
    const double radius_px = camera.fx_px * kMarginDisc_mm / in_camera_mm.z();
    cv::circle(mask,
               {static_cast<int>(std::lround(kWhole * at_px->x())), static_cast<int>(std::lround(kWhole * at_px->y()))},
               static_cast<int>(std::lround(kWhole * radius_px)), cv::Scalar(255), cv::FILLED, cv::LINE_8, kFraction);
  }
  return mask;
}

void draw_shell(const cv::Mat& mask, const Eigen::Vector3d& colour, ImageRgba& picture) {
  cv::Mat inside;
  const int width_px = std::max(1, picture.height_px / 230);
  cv::erode(mask, inside, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * width_px + 1, 2 * width_px + 1}), {-1, -1},
            1, cv::BORDER_CONSTANT, cv::Scalar(255));
  const std::array<double, 3> bright{255 * colour.x(), 255 * colour.y(), 255 * colour.z()};
  cv::Mat rgba(picture.height_px, picture.width_px, CV_8UC4, picture.rgba.data());
  for (int y = 0; y < picture.height_px; ++y) {
    for (int x = 0; x < picture.width_px; ++x) {
      if (mask.at<std::uint8_t>(y, x) == 0) continue;
      const int alpha = inside.at<std::uint8_t>(y, x) != 0 ? kFill : 255;
      auto& to = rgba.at<cv::Vec4b>(y, x);
      for (int c = 0; c < 3; ++c) {
        const double value = bright[static_cast<std::size_t>(c)] * alpha + to[c] * (255.0 - alpha);
        to[c] = static_cast<std::uint8_t>(std::lround(value / 255));
      }
      to[3] = static_cast<std::uint8_t>(alpha + to[3] * (255 - alpha) / 255);
    }
  }
}

}  // namespace

Eigen::Vector3d margin_colour(std::size_t shell) {
  constexpr std::array<std::array<int, 3>, kMostMargins> kColours{
      {{255, 255, 255}, {240, 228, 66}, {255, 150, 210}, {0, 0, 0}}};
  const auto& colour = kColours[shell % kColours.size()];
  return Eigen::Vector3d(colour[0], colour[1], colour[2]) / 255;
}

Result<Margins> margins_about(const Volume& labels, std::span<const int> values, std::vector<double> mm) {
  std::sort(mm.begin(), mm.end());
  const bool sound = !mm.empty() && mm.size() <= kMostMargins && std::all_of(mm.begin(), mm.end(), [](double one) {
    return one >= kLeastMargin_mm && one <= kMostMargin_mm;
  });
  if (!sound) {
    return Error{Errc::bad_value, fmt::format("margins of {} mm: give one to {} of {:.0f} to {:.0f} mm",
                                              fmt::join(mm, ", "), kMostMargins, kLeastMargin_mm, kMostMargin_mm)};
  }
  std::vector<std::uint8_t> mask(labels.hu.size());
  std::transform(labels.hu.begin(), labels.hu.end(), mask.begin(), [values](std::int16_t label) {
    return static_cast<std::uint8_t>(std::find(values.begin(), values.end(), label) != values.end());
  });
  const auto distance = signed_distance_of(labels, mask, kSpacing_mm, mm.back() + 2 * kSpacing_mm);
  if (!distance) return distance.error().with_context("margins");
  Margins margins;
  margins.reserve(mm.size());
  for (const double one : mm) margins.push_back(shell_at(one, *distance));
  return margins;
}

Margins deformed(const Margins& margins, const DisplacementField& field) {
  Margins out = margins;
  for (MarginShell& shell : out) {
    for (Eigen::Vector3d& place_mm : shell.places_mm) place_mm = field.deformed_of(place_mm);
  }
  return out;
}

void draw_margins(const Margins& margins, const CameraModel& camera,
                  const Transform<Camera, Patient>& camera_from_patient, ImageRgba& picture) {
  if (picture.width_px != camera.width_px || picture.height_px != camera.height_px) return;
  // The widest first: the line of a narrower one lies before it.
  for (std::size_t i = margins.size(); i-- > 0;)
    draw_shell(silhouette_of(margins[i], camera, camera_from_patient), margin_colour(i), picture);
}

}  // namespace birdseye::host
