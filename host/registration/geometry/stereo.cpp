#include "host/registration/geometry/stereo.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "host/registration/geometry/parabola.hpp"
#include "host/registration/geometry/patch.hpp"
#include "host/registration/geometry/sight.hpp"

namespace birdseye::host {

namespace {

constexpr float kLeastCorrelation = 0.6F, kLeastLead = 0.08F;
constexpr int kPeak = 4;  ///< steps to each side of a peak that are its own

struct Found {
  Eigen::Vector3d place_mm, normal, from_camera;
  double sigma_mm;
  ByLensErrors by_lens_mm;
};

/// Over the views that show the patch at this depth; -1: none does.
float mean_correlation(const std::vector<PatchSeenBy>& seen_by, double depth_mm) {
  float sum = 0, count = 0;
  for (const PatchSeenBy& other : seen_by) {
    const float r = other.correlation(depth_mm);
    if (!std::isfinite(r)) continue;
    sum += r;
    count += 1;
  }
  return count > 0 ? sum / count : -1;
}

class Sweep {
 public:
  Sweep(const std::vector<PinholeView>& views, const SeenSurface& surface, const StereoSettings& settings)
      : views_(views), surface_(surface), settings_(settings), sight_(surface, views, {kPatchFacing, 8, 10}) {}

  std::vector<Found> run() const {
    const std::vector<GridPixel> pixels = patch_grid(views_, settings_.grid_px);
    std::vector<std::optional<Found>> of_pixels(pixels.size());
    tbb::parallel_for(std::size_t{0}, pixels.size(), [&](std::size_t n) { of_pixels[n] = find(pixels[n]); });
    std::vector<Found> out;
    for (const std::optional<Found>& found : of_pixels) {
      if (found) out.push_back(*found);
    }
    return out;
  }

 private:
  std::optional<Found> find(const GridPixel& pixel) const {
    const std::size_t v = pixel.view;
    const auto patch = patch_at(views_[v], sight_.depths(v), surface_, pixel.x_px, pixel.y_px);
    if (!patch) return std::nullopt;
    const int half = static_cast<int>(std::lround(settings_.span_mm / settings_.step_mm));
    std::vector<PatchSeenBy> seen_by;
    std::vector<const PinholeView*> all{&views_[v]};
    for (std::size_t w = 0; w < views_.size(); ++w) {
      if (w == v || !sight_.sees(w, patch->place_mm)) continue;
      seen_by.emplace_back(*patch, views_[w]);
      all.push_back(&views_[w]);
    }
    if (seen_by.empty()) return std::nullopt;
    std::vector<float> score(2 * static_cast<std::size_t>(half) + 1, -1);
    const auto look_at = [&](int s) {
      const double depth = patch->depth_mm + (s - half) * settings_.step_mm;
      if (depth > 0) score[static_cast<std::size_t>(s)] = mean_correlation(seen_by, depth);
    };
    const auto best_so_far = [&] {
      return static_cast<int>(std::max_element(score.begin(), score.end()) - score.begin());
    };
    // Every other depth, then all about the best.
    for (int s = 0; s <= 2 * half; s += 2) look_at(s);
    const int near = best_so_far();
    for (int s = std::max(1, near - kPeak + 1); s <= std::min(2 * half - 1, near + kPeak - 1); s += 2) look_at(s);
    const int best = best_so_far();
    const auto at = [&](int s) { return score[static_cast<std::size_t>(s)]; };
    if (at(best) < kLeastCorrelation || best == 0 || best == 2 * half) return std::nullopt;
    for (int s = 0; s <= 2 * half; ++s) {
      if (std::abs(s - best) > kPeak && at(s) > at(best) - kLeastLead) return std::nullopt;
    }
    const float bend = bend_of(at(best - 1), at(best), at(best + 1));
    const double between = peak_between(at(best - 1), at(best), at(best + 1));
    const double depth = patch->depth_mm + (best - half + between) * settings_.step_mm;
    // The flatter the peak and the less alike the patches, the less is known; of stereo on simulated organs, where the
    // truth is known, 0.45 of it and what it says nothing of.
    constexpr double kOfPeak = 0.45, kBeside_mm = 0.08;
    const double facing = -patch->normal.dot(patch->ray);
    const double of_peak_mm = settings_.step_mm * facing * std::sqrt(static_cast<double>((1 - at(best)) / bend));
    const double sigma_mm = std::hypot(kOfPeak * of_peak_mm, kBeside_mm);
    const Eigen::Vector3d place_mm = views_[v].eye_in_patient_mm + depth * patch->ray;
    return Found{place_mm, patch->normal, patch->ray.normalized(), sigma_mm, by_lens_errors(place_mm, all)};
  }

  const std::vector<PinholeView>& views_;
  const SeenSurface& surface_;
  const StereoSettings& settings_;
  Sight sight_;
};

/// Whether a point lies on the plane through its neighbours, robustly fitted.
std::vector<bool> in_line(const std::vector<Found>& points) {
  constexpr std::size_t kNeighbours = 12;
  constexpr double kOff_mm = 0.8, kFarthest_mm = 25, kLeastWeight = 0.45;
  std::vector<bool> keep(points.size(), true);
  for (int pass = 0; pass < 2; ++pass) {
    std::vector<std::size_t> among;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (keep[i]) among.push_back(i);
    }
    std::vector<std::uint8_t> good(points.size(), 0);
    if (among.size() <= kNeighbours) return std::vector<bool>(points.size(), false);
    tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
      const Found& p = points[i];
      std::vector<std::pair<double, std::size_t>> near;
      near.reserve(among.size());
      for (const std::size_t j : among) {
        if (j != i) near.emplace_back((points[j].place_mm - p.place_mm).squaredNorm(), j);
      }
      const std::size_t count = std::min(kNeighbours, near.size());
      std::nth_element(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count - 1), near.end());
      near.resize(count);
      if (near.back().first > kFarthest_mm * kFarthest_mm) return;
      const Eigen::Vector3d aside =
          p.normal.cross(std::abs(p.normal.x()) < 0.8 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY())
              .normalized();
      const Eigen::Vector3d other = p.normal.cross(aside);
      std::array<double, kNeighbours> weight;
      weight.fill(1);
      Eigen::Vector3d plane = Eigen::Vector3d::Zero();
      for (int round = 0; round < 4; ++round) {
        Eigen::Matrix3d a = 1e-3 * Eigen::Matrix3d::Identity();
        Eigen::Vector3d b = Eigen::Vector3d::Zero();
        for (std::size_t n = 0; n < count; ++n) {
          const Eigen::Vector3d d = points[near[n].second].place_mm - p.place_mm;
          const Eigen::Vector3d row(1, aside.dot(d), other.dot(d));
          a += weight[n] * row * row.transpose();
          b += weight[n] * row * p.normal.dot(d);
        }
        plane = a.llt().solve(b);
        for (std::size_t n = 0; n < count; ++n) {
          const Eigen::Vector3d d = points[near[n].second].place_mm - p.place_mm;
          const double off = p.normal.dot(d) - plane.dot(Eigen::Vector3d(1, aside.dot(d), other.dot(d)));
          weight[n] = 1 / std::pow(1 + off * off / (kOff_mm * kOff_mm), 2);
        }
      }
      double sum = 0;
      for (std::size_t n = 0; n < count; ++n) sum += weight[n];
      good[i] = std::abs(plane[0]) < kOff_mm && sum > kLeastWeight * static_cast<double>(count) ? 1 : 0;
    });
    for (std::size_t i = 0; i < points.size(); ++i) keep[i] = good[i] != 0;
  }
  return keep;
}

}  // namespace

std::vector<SeenPoint> stereo_points(const std::vector<PinholeView>& views, const SeenSurface& surface,
                                     const StereoSettings& settings) {
  const std::vector<Found> found = Sweep(views, surface, settings).run();
  const std::vector<bool> keep = in_line(found);
  std::vector<SeenPoint> out;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (!keep[i]) continue;
    out.push_back({found[i].place_mm, found[i].sigma_mm, found[i].from_camera});
    out.back().by_lens_mm = found[i].by_lens_mm;
  }
  return out;
}

}  // namespace birdseye::host
