#include "host/registration/rigid/surface_refinement.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>

#include "calibration/geometry/rotations.hpp"
#include "calibration/points/point_error.hpp"

namespace birdseye::host {

namespace {

using Points = std::span<const Eigen::Vector3d>;
using Pose = Transform<Patient, Tracker>;
using Normal6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double kKept = 0.9;
constexpr std::size_t kFewest = 10;
constexpr int kMostIterations = 100;
constexpr double kStill_mm = 1e-4;
constexpr double kChance = 0.01;
/// Neither CT surface nor fiducials are better than this, whatever few residuals say.
constexpr double kFinest_mm = 0.3;

/// A hand that holds still gives one place many times over, and all of them err together: by the tip's pressure, by the
/// tracker there. Places nearer to one another than a pointer's ball is wide count as one.
constexpr double kOnePlace_mm = 3;

/// The touched places, one for all that lie within kOnePlace_mm of it: their middle.
std::vector<Eigen::Vector3d> thinned(Points touched_mm) {
  struct Place {
    Eigen::Vector3d first_mm, sum_mm;
    double count = 1;
  };
  using Cell = std::array<std::int64_t, 3>;
  const auto cell_of = [](const Eigen::Vector3d& p) {
    const Eigen::Vector3d cell = (p / kOnePlace_mm).array().floor();
    return Cell{static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()),
                static_cast<std::int64_t>(cell.z())};
  };
  std::vector<Place> places;
  std::map<Cell, std::vector<std::size_t>> by_cell;
  const auto place_at = [&](const Eigen::Vector3d& p) -> Place* {
    const Cell at = cell_of(p);
    for (std::int64_t n = 0; n < 27; ++n) {
      const auto cell = by_cell.find({at[0] + n / 9 - 1, at[1] + n / 3 % 3 - 1, at[2] + n % 3 - 1});
      if (cell == by_cell.end()) continue;
      for (const std::size_t i : cell->second) {
        if ((places[i].first_mm - p).norm() < kOnePlace_mm) return &places[i];
      }
    }
    return nullptr;
  };
  for (const Eigen::Vector3d& p : touched_mm) {
    if (Place* const place = place_at(p)) {
      place->sum_mm += p;
      place->count += 1;
    } else {
      by_cell[cell_of(p)].push_back(places.size());
      places.push_back({p, p});
    }
  }
  std::vector<Eigen::Vector3d> out;
  out.reserve(places.size());
  for (const Place& place : places) out.emplace_back(place.sum_mm / place.count);
  return out;
}

struct Pair {
  Eigen::Vector3d here_mm;
  SurfacePoint there;
};

/// The touched points as posed with the surface points next to them, the nearest first.
std::vector<Pair> pairs_of(const SurfaceIndex& index, Points touched_mm, const Pose& pose) {
  std::vector<Pair> pairs;
  pairs.reserve(touched_mm.size());
  for (const Eigen::Vector3d& p : touched_mm) {
    const Eigen::Vector3d here = pose * p;
    pairs.push_back({here, index.nearest(here)});
  }
  std::sort(pairs.begin(), pairs.end(),
            [](const Pair& a, const Pair& b) { return a.there.distance_mm < b.there.distance_mm; });
  pairs.resize(static_cast<std::size_t>(std::ceil(kKept * static_cast<double>(pairs.size()))));
  return pairs;
}

double rms_mm(const std::vector<Pair>& pairs) {
  double squares = 0;
  for (const Pair& p : pairs) squares += p.there.distance_mm * p.there.distance_mm;
  return std::sqrt(squares / static_cast<double>(pairs.size()));
}

/// d(p + w x (p - about) + t) for w and t.
Eigen::Matrix<double, 3, 6> motion_at(const Eigen::Vector3d& from_pivot_mm) {
  Eigen::Matrix<double, 3, 6> j;
  j << 0, from_pivot_mm.z(), -from_pivot_mm.y(), 1, 0, 0,  //
      -from_pivot_mm.z(), 0, from_pivot_mm.x(), 0, 1, 0,   //
      from_pivot_mm.y(), -from_pivot_mm.x(), 0, 0, 0, 1;
  return j;
}

double moved_rms_mm(Points points_mm, const Pose& a, const Pose& b) {
  double squares = 0;
  for (const Eigen::Vector3d& p : points_mm) squares += (a * p - b * p).squaredNorm();
  return std::sqrt(squares / static_cast<double>(points_mm.size()));
}

/// How far the refinement may move n fiducials, root mean square: n moved^2 / 6 over the variance of a coordinate is
/// F distributed with 6 and the estimate's degrees of freedom.
double allowed_mm(std::size_t n, double localisation_mm, int degrees_of_freedom) {
  const double dof = degrees_of_freedom > 0 ? degrees_of_freedom : 1e6;
  double low = 0;
  double high = 1e6;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (calibration::f_tail(middle, 6, dof) > kChance ? low : high) = middle;
  }
  return localisation_mm * std::sqrt(2 * high / static_cast<double>(n));
}

}  // namespace

Result<SurfaceRefinement> refine_on_surface(const Surface& surface, Points given_mm, const FiducialAnchor& anchor) {
  constexpr double kFarthest_mm = 1e9;  // what is farther has no cell
  for (const Eigen::Vector3d& p : given_mm) {
    if (!p.allFinite()) return Error{Errc::bad_value, "a surface point has a coordinate that is not a finite number"};
    if (p.cwiseAbs().maxCoeff() >= kFarthest_mm) {
      return Error{Errc::bad_value,
                   "a surface point has a coordinate of a thousand kilometres and more: is the file in "
                   "mm, with a number for each coordinate?"};
    }
  }
  const std::vector<Eigen::Vector3d> touched_mm = thinned(given_mm);
  if (touched_mm.size() < kFewest) {
    const std::string places = touched_mm.size() == given_mm.size()
                                   ? fmt::format("{} points on the surface", given_mm.size())
                                   : fmt::format("{} points on the surface (places {} mm apart: {})", given_mm.size(),
                                                 kOnePlace_mm, touched_mm.size());
    return Error{Errc::degenerate, fmt::format("{}: touch at least {}, spread over it", places, kFewest)};
  }
  const SurfaceIndex index(surface);
  const double localisation_mm = std::max(anchor.localisation_rms_mm, kFinest_mm);
  Pose pose = anchor.patient_from_tracker;
  SurfaceRefinement out;
  out.points = given_mm.size();
  out.places = touched_mm.size();
  std::vector<Pair> pairs = pairs_of(index, touched_mm, pose);
  const double places_before_mm = rms_mm(pairs);
  out.rms_before_mm = rms_mm(pairs_of(index, given_mm, pose));
  for (double step_mm = 1; out.iterations < kMostIterations && step_mm > kStill_mm; ++out.iterations) {
    Eigen::Vector3d pivot = Eigen::Vector3d::Zero();
    for (const Pair& p : pairs) pivot += p.here_mm / static_cast<double>(pairs.size());
    Normal6 a = Normal6::Zero();
    Vector6 b = Vector6::Zero();
    // The same tip touches both, so that surface and fiducials weigh alike. Weights from the spread of the pairs would
    // grow with any disagreement between the two, and hide it.
    for (const Pair& p : pairs) {
      const Vector6 j = motion_at(p.here_mm - pivot).transpose() * p.there.normal;
      a += j * j.transpose();
      b += j * p.there.normal.dot(p.there.point_mm - p.here_mm);
    }
    for (const Eigen::Vector3d& p : anchor.touched_in_tracker_mm) {
      const Eigen::Matrix<double, 3, 6> j = motion_at(pose * p - pivot);
      a += j.transpose() * j;
      b += j.transpose() * (anchor.patient_from_tracker * p - pose * p);
    }
    const Vector6 step = a.ldlt().solve(b);
    const Eigen::Matrix3d turn = rotation_exp(step.head<3>());
    const Pose moved(Eigen::Matrix3d(turn * pose.rotation()),
                     Eigen::Vector3d(turn * (pose.translation() - pivot) + pivot + step.tail<3>()));
    step_mm = moved_rms_mm(touched_mm, moved, pose);
    pose = moved;
    pairs = pairs_of(index, touched_mm, pose);
  }
  out.kept = pairs.size();
  out.rms_after_mm = rms_mm(pairs_of(index, given_mm, pose));
  out.moved_mm = moved_rms_mm(anchor.touched_in_tracker_mm, pose, anchor.patient_from_tracker);
  out.turned_rad = rotation_angle_between(pose.rotation(), anchor.patient_from_tracker.rotation());
  out.allowed_mm = allowed_mm(anchor.touched_in_tracker_mm.size(), localisation_mm, anchor.degrees_of_freedom);
  out.accepted = out.moved_mm <= out.allowed_mm && rms_mm(pairs) < places_before_mm;
  out.surface_pose = pose;
  out.patient_from_tracker = out.accepted ? pose : anchor.patient_from_tracker;
  const std::string distances =
      fmt::format("surface points {:.2f} mm rms before, {:.2f} mm after", out.rms_before_mm, out.rms_after_mm);
  if (out.accepted) {
    out.told = fmt::format("{}; fiducials moved {:.2f} mm, of {:.2f} mm that their error allows", distances,
                           out.moved_mm, out.allowed_mm);
  } else if (out.moved_mm > out.allowed_mm) {
    out.told = fmt::format(
        "the surface is refused: it would move the fiducials by {:.2f} mm, where their error allows {:.2f} mm ({}); "
        "was "
        "it touched where the CT has it?",
        out.moved_mm, out.allowed_mm, distances);
  } else {
    out.told = fmt::format("the surface is refused: it brings the points no nearer ({})", distances);
  }
  return out;
}

}  // namespace birdseye::host
