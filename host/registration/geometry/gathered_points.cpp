#include "host/registration/geometry/gathered_points.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace birdseye::host {

namespace {

constexpr double kCell_mm = 10;
/// Of neighbours' variance, what a mean over them does not lessen: patches overlap, and what misleads one misleads the
/// next.
constexpr double kCommon = 0.12;
constexpr double kLeastSigma_mm = 0.15;

/// Points of one cell of space.
using Cells = std::map<std::tuple<int, int, int>, std::vector<std::size_t>>;

Cells cells_of(std::span<const SeenPoint> points) {
  Cells out;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d cell = (points[i].place_mm / kCell_mm).array().floor();
    out[{static_cast<int>(cell.x()), static_cast<int>(cell.y()), static_cast<int>(cell.z())}].push_back(i);
  }
  return out;
}

/// What all rows of a file have wrong together, of one axis: the pointer's tip, and where the views have the patient,
/// are some tenths of a millimetre off, and a file does not say by how much.
constexpr double kRowsShift_mm = 0.3;

}  // namespace

std::vector<SeenPoint> gathered_points(std::span<const SeenPoint> points, const SeenSurface& surface) {
  std::vector<SeenPoint> out;
  for (const auto& [cell, members] : cells_of(points)) {
    std::vector<double> off_mm;
    off_mm.reserve(members.size());
    for (const std::size_t i : members) off_mm.push_back(surface.distance().distance_mm(points[i].place_mm));
    std::vector<double> sorted = off_mm;
    std::sort(sorted.begin(), sorted.end());
    double mean_mm = sorted[sorted.size() / 2];
    // Geman and McClure's mean about the median; the spread begins as one believes it before any point is seen.
    constexpr double kBefore = 3;
    const double before_mm = points[members.front()].sigma_mm;
    double variance_mm2 = before_mm * before_mm, count = 1;
    Eigen::Vector3d place_mm = points[members.front()].place_mm, from_camera = Eigen::Vector3d::Zero();
    ByLensErrors by_lens_mm = points[members.front()].by_lens_mm;
    for (int round = 0; round < 5; ++round) {
      const double scale2 = 9 * variance_mm2;
      double sum = 0, sum_off = 0, sum_square = 0;
      place_mm.setZero();
      from_camera.setZero();
      by_lens_mm.setZero();
      for (std::size_t n = 0; n < members.size(); ++n) {
        const SeenPoint& point = points[members[n]];
        const double from_mean = off_mm[n] - mean_mm;
        const double relative = before_mm / point.sigma_mm;
        const double weight = relative * relative / std::pow(1 + from_mean * from_mean / scale2, 2);
        sum += weight;
        sum_off += weight * off_mm[n];
        sum_square += weight * from_mean * from_mean;
        place_mm += weight * point.place_mm;
        by_lens_mm += weight * point.by_lens_mm;
        if (point.from_camera) from_camera += weight * *point.from_camera;
      }
      mean_mm = sum_off / sum;
      place_mm /= sum;
      by_lens_mm /= sum;
      variance_mm2 = (kBefore * before_mm * before_mm + sum_square) / (kBefore + sum);
      count = sum;
    }
    // The middle of a bent patch lies off it.
    const Eigen::Vector3d normal = surface.normal(place_mm);
    place_mm += (mean_mm - surface.distance().distance_mm(place_mm)) * normal;
    SeenPoint gathered{place_mm, std::max(kLeastSigma_mm, std::sqrt(variance_mm2 * (1 / count + kCommon))),
                       std::nullopt, points[members.front()].shift_mm, points[members.front()].broad_mm};
    gathered.by_lens_mm = by_lens_mm;
    if (points[members.front()].from_camera) gathered.from_camera = from_camera.normalized();
    out.push_back(gathered);
  }
  return out;
}

GatheredRows gathered_rows(std::span<const SeenPoint> rows, const SeenSurface& surface) {
  constexpr double kAgreeSigmas = 3;
  std::vector<SeenPoint> sound(rows.begin(), rows.end());
  std::vector<double> off_mm;
  for (SeenPoint& row : sound) {
    row.sigma_mm = std::max(row.sigma_mm, kLeastSigma_mm);
    row.shift_mm = std::max(row.shift_mm, kRowsShift_mm);
    off_mm.push_back(surface.distance().distance_mm(row.place_mm));
  }
  GatheredRows out;
  out.of_row.resize(sound.size());
  for (auto [cell, members] : cells_of(sound)) {
    std::ranges::sort(members, {}, [&](std::size_t i) { return off_mm[i]; });
    for (auto first = members.begin(); first != members.end();) {
      auto end = first + 1;
      // From the first, for a chain of rows that agree each with the next has ends that contradict one another.
      while (end != members.end() &&
             off_mm[*end] - off_mm[*first] <= kAgreeSigmas * std::hypot(sound[*end].sigma_mm, sound[*first].sigma_mm))
        ++end;
      std::vector<SeenPoint> alike;
      for (auto member = first; member != end; ++member) {
        alike.push_back(sound[*member]);
        out.of_row[*member] = out.points.size();
      }
      out.points.push_back(alike.size() == 1 ? alike.front() : gathered_points(alike, surface).front());
      first = end;
    }
  }
  return out;
}

}  // namespace birdseye::host
