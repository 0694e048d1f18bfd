#include "host/registration/geometry/landmark_rays.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace birdseye::host {

namespace {

/// How far a landmark may have moved, an axis: far enough to say nothing where two rays cross.
constexpr double kMoved_mm = 50;

/// A pixel without its lens's distortion: x and y at unit depth.
struct Sighting {
  Eigen::Vector2d at;
  Eigen::Matrix2d information;  ///< the inverse of its covariance
};

Result<Sighting> sighting_of(const LandmarkPixel& one) {
  const Eigen::Vector2d& pixel = one.pixel_px;
  if (!(pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() <= one.camera.width_px - 0.5 &&
        pixel.y() <= one.camera.height_px - 0.5)) {
    return Error{Errc::bad_value,
                 fmt::format("{}: pixel {:g}, {:g} lies outside the picture, which is of {}x{}", one.view, pixel.x(),
                             pixel.y(), one.camera.width_px, one.camera.height_px)};
  }
  if (!(one.sigma_px > 0 && std::isfinite(one.sigma_px)))
    return Error{Errc::bad_value, fmt::format("{}: sigma_px is {:g}; give one over 0", one.view, one.sigma_px)};
  Eigen::Matrix2d slope;
  const auto ray = unproject(one.camera, pixel, &slope);
  if (!ray) {
    return Error{Errc::bad_value, fmt::format("{}: the lens sees nothing at pixel {:g}, {:g}; name another view",
                                              one.view, pixel.x(), pixel.y())};
  }
  const Eigen::Matrix2d covariance = one.sigma_px * one.sigma_px * slope * slope.transpose();
  return Sighting{ray->head<2>(), covariance.inverse()};
}

/// Of the sum of squares whose least is the landmark's place.
struct Squares {
  Eigen::Matrix3d information;
  Eigen::Vector3d slope;  ///< half of its derivative, downwards
  double misfit;          ///< of the pixels alone
};

/// Empty where a camera has the place behind it.
std::optional<Squares> squares_at(const Eigen::Vector3d& place_mm, const Eigen::Vector3d& rest_mm,
                                  std::span<const LandmarkPixel> pixels, std::span<const Sighting> sightings) {
  Squares out{Eigen::Matrix3d::Identity() / (kMoved_mm * kMoved_mm), (rest_mm - place_mm) / (kMoved_mm * kMoved_mm), 0};
  for (std::size_t n = 0; n < pixels.size(); ++n) {
    const Eigen::Vector3d c = pixels[n].camera_from_patient * place_mm;
    constexpr double kNearest_mm = 1;
    if (!(c.z() > kNearest_mm)) return std::nullopt;
    Eigen::Matrix<double, 2, 3> by_camera;
    by_camera << 1 / c.z(), 0, -c.x() / (c.z() * c.z()), 0, 1 / c.z(), -c.y() / (c.z() * c.z());
    const Eigen::Matrix<double, 2, 3> by_place = by_camera * pixels[n].camera_from_patient.rotation();
    const Eigen::Vector2d off = sightings[n].at - Eigen::Vector2d(c.x() / c.z(), c.y() / c.z());
    out.information += by_place.transpose() * sightings[n].information * by_place;
    out.slope += by_place.transpose() * sightings[n].information * off;
    out.misfit += off.dot(sightings[n].information * off);
  }
  return out;
}

}  // namespace

Result<MatchedPoint> matched_by_rays(const Eigen::Vector3d& rest_mm, double rest_sigma_mm,
                                     std::span<const LandmarkPixel> pixels) {
  if (!(rest_sigma_mm > 0 && std::isfinite(rest_sigma_mm)))
    return Error{Errc::bad_value, fmt::format("sigma_mm is {:g}; give one over 0", rest_sigma_mm)};
  if (pixels.empty()) return Error{Errc::bad_value, "no view shows it; name one or more"};
  std::vector<Sighting> sightings;
  for (const LandmarkPixel& one : pixels) {
    const auto sighting = sighting_of(one);
    if (!sighting) return sighting.error();
    sightings.push_back(*sighting);
  }
  Eigen::Vector3d place_mm = rest_mm;
  std::optional<Squares> squares;
  constexpr int kSteps = 20;
  for (int step = 0; step < kSteps; ++step) {
    squares = squares_at(place_mm, rest_mm, pixels, sightings);
    if (!squares) {
      return Error{Errc::bad_value,
                   "lies behind a camera that is said to see it: check its place in the CT and the views' poses"};
    }
    const Eigen::Vector3d move_mm = squares->information.llt().solve(squares->slope);
    place_mm += move_mm;
    constexpr double kStill_mm = 1e-6;
    if (move_mm.norm() < kStill_mm) break;
  }
  MatchedPoint out{rest_mm, place_mm, squares->information.inverse()};
  if (pixels.size() > 1) {
    const auto freedom = static_cast<double>(2 * pixels.size() - 3);
    out.covariance_mm2 *= std::max(1.0, squares->misfit / freedom);
  }
  out.covariance_mm2 += rest_sigma_mm * rest_sigma_mm * Eigen::Matrix3d::Identity();
  return out;
}

}  // namespace birdseye::host
