#include "calibration/detect/dot_lattice.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

namespace birdseye::calibration {

namespace {

constexpr std::size_t kMostSeeds = 24;
constexpr double kOffStep = 0.3;         // of the shorter step: from dot to dot even a near, tilted grid changes less
constexpr int kMapReach = 2;             // steps to either side
constexpr double kLeastOff_px = 0.7;     // noise and blur move no dot as far
constexpr double kOffMap = 0.03;         // of a step: what a map of second order leaves of perspective
constexpr double kOffNeighbours = 0.15;  // of a step: at a corner the neighbours, all to one side, foretell no better
constexpr double kAreaRatio = 20;        // larger dots are up to 4 times as wide; beyond, it is no dot of this grid
constexpr double kLeastSine = 0.4;       // between the two steps; a tilt of 60 degrees makes it 0.5 at worst
constexpr double kMostStepRatio = 3;     // long over short step

using Places = std::map<std::pair<int, int>, std::size_t>;

bool alike(const DotBlob& a, const DotBlob& b) {
  return a.area_px2 < kAreaRatio * b.area_px2 && b.area_px2 < kAreaRatio * a.area_px2;
}

/// The two shortest steps from a dot to others like it, the second clockwise of the first. Empty where there are none.
std::optional<Eigen::Matrix2d> steps_at(const std::vector<DotBlob>& blobs, std::size_t seed) {
  std::vector<Eigen::Vector2d> steps;
  for (std::size_t i = 0; i < blobs.size(); ++i) {
    if (i != seed && alike(blobs[i], blobs[seed])) steps.emplace_back(blobs[i].centroid_px - blobs[seed].centroid_px);
  }
  if (steps.size() < 2) return std::nullopt;
  const auto near = steps.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(8, steps.size()));
  std::partial_sort(steps.begin(), near, steps.end(),
                    [](const auto& a, const auto& b) { return a.squaredNorm() < b.squaredNorm(); });
  for (auto step = steps.begin() + 1; step != near; ++step) {
    Eigen::Matrix2d both;
    both << steps[0], *step;
    const double sine = both.determinant() / (steps[0].norm() * step->norm());
    if (std::abs(sine) < kLeastSine) continue;
    if (step->norm() > kMostStepRatio * steps[0].norm()) return std::nullopt;
    if (sine < 0) both.col(1) *= -1;
    return both;
  }
  return std::nullopt;
}

class Growth {
 public:
  explicit Growth(const std::vector<DotBlob>& blobs) : blobs_(blobs), taken_(blobs.size(), false) {}

  std::vector<GridPoint> from(std::size_t seed, const Eigen::Matrix2d& steps) {
    add({0, 0}, seed, steps);
    while (!open_.empty()) {
      const Reached at = open_.front();
      open_.pop_front();
      for (const Eigen::Vector2i& way :
           {Eigen::Vector2i(1, 0), Eigen::Vector2i(0, 1), Eigen::Vector2i(-1, 0), Eigen::Vector2i(0, -1)}) {
        step_on(at, way);
      }
    }
    return std::move(points_);
  }

 private:
  struct Reached {
    Eigen::Vector2i place;
    std::size_t blob;
    Eigen::Matrix2d steps;  ///< px, by column
  };

  void add(const Eigen::Vector2i& place, std::size_t blob, const Eigen::Matrix2d& steps) {
    taken_[blob] = true;
    places_[{place.x(), place.y()}] = blob;
    points_.push_back({static_cast<int>(blob), place, blobs_[blob].centroid_px});
    open_.push_back({place, blob, steps});
  }

  void step_on(const Reached& at, const Eigen::Vector2i& way) {
    const Eigen::Vector2i place = at.place + way;
    if (places_.contains({place.x(), place.y()})) return;
    Eigen::Vector2d step = at.steps * way.cast<double>();
    // On through two known dots: follows what perspective and distortion do to the steps.
    const auto behind = places_.find({at.place.x() - way.x(), at.place.y() - way.y()});
    const Eigen::Vector2d& here = blobs_[at.blob].centroid_px;
    if (behind != places_.end()) step = here - blobs_[behind->second].centroid_px;
    const auto blob = nearest(here + step, kOffStep * std::min(at.steps.col(0).norm(), at.steps.col(1).norm()));
    if (!blob || !alike(blobs_[*blob], blobs_[at.blob])) return;
    Eigen::Matrix2d steps = at.steps;
    const Eigen::Vector2d made = blobs_[*blob].centroid_px - here;
    steps.col(way.x() != 0 ? 0 : 1) = made * (way.x() + way.y());
    add(place, *blob, steps);
  }

  [[nodiscard]] std::optional<std::size_t> nearest(const Eigen::Vector2d& px, double within_px) const {
    std::optional<std::size_t> best;
    double least = within_px * within_px;
    for (std::size_t i = 0; i < blobs_.size(); ++i) {
      const double apart = (blobs_[i].centroid_px - px).squaredNorm();
      if (taken_[i] || apart > least) continue;
      least = apart;
      best = i;
    }
    return best;
  }

  const std::vector<DotBlob>& blobs_;
  std::vector<bool> taken_;
  Places places_;
  std::deque<Reached> open_;
  std::vector<GridPoint> points_;
};

/// With curvature also at a grid's corners, where a map that reaches two steps has none.
std::optional<LocalMap> local_map(const std::vector<GridPoint>& points, const Eigen::Vector2i& place) {
  auto map = fit_local_map(points, place, kMapReach, false);
  if (map && !(map->hxx.isZero(0) && map->hxy.isZero(0) && map->hyy.isZero(0))) return map;
  return fit_local_map(points, place, kMapReach + 1, false);
}

/// Takes out, worst first, spots that their neighbours' map, fitted with them, does not meet: half covered dots and
/// what stands nearly where a dot should. Where all neighbours are to one side a spot bends the map to itself, so that
/// a grid's corners are not held against an extrapolation, as drop_strays would.
void drop_odd_spots(std::vector<GridPoint>& points) {
  const auto judge = [&](const GridPoint& point) {
    const auto map = local_map(points, point.place);
    if (!map) return 0.0;
    const double step_px = std::sqrt(std::abs(map->jacobian.determinant()));
    return (point.px - map->a).norm() / std::max(kLeastOff_px, kOffMap * step_px);
  };
  std::vector<double> excess;
  excess.reserve(points.size());
  for (const GridPoint& point : points) excess.push_back(judge(point));
  while (!points.empty()) {
    const auto worst = std::max_element(excess.begin(), excess.end());
    if (*worst <= 1) return;
    const auto at = worst - excess.begin();
    const Eigen::Vector2i gone = points[static_cast<std::size_t>(at)].place;
    points.erase(points.begin() + at);
    excess.erase(worst);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if ((points[i].place - gone).cwiseAbs().maxCoeff() <= kMapReach + 1) excess[i] = judge(points[i]);
    }
  }
}

/// Spots to begin at: from the middle of all of them outwards, spread over them all.
std::vector<std::size_t> seeds_of(const std::vector<DotBlob>& blobs) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const DotBlob& blob : blobs) middle += blob.centroid_px / static_cast<double>(blobs.size());
  std::vector<std::size_t> order(blobs.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return (blobs[a].centroid_px - middle).squaredNorm() < (blobs[b].centroid_px - middle).squaredNorm();
  });
  std::vector<std::size_t> seeds;
  const std::size_t stride = std::max<std::size_t>(1, order.size() / kMostSeeds);
  for (std::size_t i = 0; i < order.size(); i += stride) seeds.push_back(order[i]);
  return seeds;
}

}  // namespace

std::vector<GridPoint> grow_dot_lattice(const std::vector<DotBlob>& blobs, std::size_t enough) {
  std::vector<GridPoint> best;
  for (const std::size_t seed : seeds_of(blobs)) {
    const auto in_best = [&](const GridPoint& point) { return point.id == static_cast<int>(seed); };
    if (std::any_of(best.begin(), best.end(), in_best)) continue;
    const auto steps = steps_at(blobs, seed);
    if (!steps) continue;
    auto points = Growth(blobs).from(seed, *steps);
    drop_strays(points, [](double step_px) { return std::max(1.5, kOffNeighbours * step_px); });
    drop_odd_spots(points);
    if (points.size() > best.size()) best = std::move(points);
    if (best.size() >= enough || 2 * best.size() > blobs.size()) break;
  }
  return best;
}

std::vector<DotLook> look_at_dots(const std::vector<GridPoint>& points, const std::vector<DotBlob>& blobs) {
  std::vector<DotLook> looks;
  for (const GridPoint& point : points) {
    DotLook look{0, point.px};
    if (const auto map = local_map(points, point.place)) {
      const double area_steps =
          blobs[static_cast<std::size_t>(point.id)].area_px2 / std::abs(map->jacobian.determinant());
      const double square_of_radius = area_steps / std::numbers::pi;
      look.diameter_steps = 2 * std::sqrt(square_of_radius);
      Eigen::Matrix2d by_x, by_y;
      by_x << map->hxx, map->hxy;
      by_y << map->hxy, map->hyy;
      const Eigen::Matrix2d inverse = map->jacobian.inverse();
      const Eigen::Vector2d gradient((inverse * by_x).trace(), (inverse * by_y).trace());
      const Eigen::Vector2d off = square_of_radius / 4 * (map->jacobian * gradient + (map->hxx + map->hyy) / 2);
      look.centre_px = point.px - off;
    }
    looks.push_back(look);
  }
  return looks;
}

}  // namespace birdseye::calibration
