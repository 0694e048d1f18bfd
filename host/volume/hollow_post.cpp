#include "host/volume/hollow_post.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

namespace birdseye::host {

namespace {

using Eigen::Vector3d;

constexpr int kDirections = 512, kFewDirections = 96;  // each beside its opposite
constexpr double kStep_mm = 0.2;                       // along a ray
constexpr double kBeyond_mm = 8;                       // of air behind a wall, that it is no cell beside another
constexpr double kThickest_mm = 5;                     // wall that counts as thin; obliquely seen, it is thicker
constexpr double kPlateau_mm = 3;  // behind the edge; a wall that has not thinned out by then is solid
constexpr double kLeastContrast_hu = 250;
constexpr double kDensest = 0.95;
constexpr double kLeastFree = 0.1;
constexpr double kLikeAir_hu = 60;
constexpr double kRimSigma_mm = 0.025;  // of the centre of an open cavity
constexpr double kLeastOpen = 0.02;     // of the directions; less is a channel, or a wall too thin to be seen

/// Directions over the sphere, each followed by its opposite.
std::vector<Vector3d> directions_of(int count) {
  std::vector<Vector3d> out;
  const double turn = std::numbers::pi * (3 - std::sqrt(5.0));
  const int half = count / 2;
  for (int n = 0; n < half; ++n) {
    const double up = (n + 0.5) / half;  // a hemisphere
    const double across = std::sqrt(1 - up * up);
    out.emplace_back(across * std::cos(n * turn), across * std::sin(n * turn), up);
    out.emplace_back(-out.back());
  }
  return out;
}

/// Keys's cubic convolution: it keeps sums and centroids, and has the ridge of a wall between voxels.
std::array<double, 4> cubic_weights(double t) {
  return {((-0.5 * t + 1) * t - 0.5) * t, (1.5 * t - 2.5) * t * t + 1, ((-1.5 * t + 2) * t + 0.5) * t,
          (0.5 * t - 0.5) * t * t};
}

/// HU between the voxels; those at the border are continued.
double sample(const Volume& ct, const Vector3d& voxel) {
  const Eigen::Array3i low = voxel.array().floor().cast<int>();
  std::array<std::array<double, 4>, 3> weights{};
  std::array<std::array<int, 4>, 3> at{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    weights[axis] = cubic_weights(voxel[a] - low[a]);
    for (std::size_t n = 0; n < 4; ++n)
      at[axis][n] = std::clamp(low[a] - 1 + static_cast<int>(n), 0, ct.size[axis] - 1);
  }
  double sum = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t j = 0; j < 4; ++j) {
      const double weight = weights[2][k] * weights[1][j];
      for (std::size_t i = 0; i < 4; ++i) sum += weight * weights[0][i] * ct.at(at[0][i], at[1][j], at[2][k]);
    }
  }
  return sum;
}

/// What one ray meets. Lengths from the centre, mm; NaN where there is none.
struct Ray {
  std::vector<double> hu;  ///< each kStep_mm
  double edge_mm = NAN;    ///< where the wall begins
  double ridge_mm = NAN;   ///< where it is densest
  double ridge_hu = 0;
  double outside_mm = NAN;  ///< where it ends
  bool air_beyond = false;
};

std::size_t step_at(double length_mm) {
  return static_cast<std::size_t>(std::max(0.0, length_mm) / kStep_mm);
}

/// The first place from begin on, up to end, where the profile is at least level (rising) or at most (falling).
double crossing(const std::vector<double>& hu, std::size_t begin, std::size_t end, double level, bool rising) {
  for (std::size_t n = begin; n < std::min(end, hu.size()); ++n) {
    if (rising ? hu[n] < level : hu[n] > level) continue;
    const double before = n > begin ? hu[n - 1] : hu[n];
    const double part = n > begin && hu[n] != before ? (level - before) / (hu[n] - before) : 1;
    return (static_cast<double>(n) - 1 + part) * kStep_mm;
  }
  return NAN;
}

void measure(Ray& ray, double air_hu, double widest_mm) {
  const std::vector<double>& hu = ray.hu;
  const std::size_t last = std::min(hu.size(), step_at(widest_mm));
  std::size_t top = 0;
  std::size_t rise = 0;  // where the wall is first met
  for (std::size_t n = 0; n < last; ++n) {
    if (hu[n] > hu[top]) top = n;
    if (rise == 0 && hu[n] > air_hu + kLeastContrast_hu) rise = n;
    if (rise == 0) continue;
    const double height = hu[top] - air_hu;
    if (hu[n] < hu[top] - 0.25 * height || static_cast<double>(n - rise) * kStep_mm > kPlateau_mm) break;
  }
  if (rise == 0) return;
  ray.ridge_hu = hu[top];
  ray.ridge_mm = static_cast<double>(top) * kStep_mm;
  const double half = 0.5 * (hu[top] + air_hu);
  ray.edge_mm = crossing(hu, 0, top + 1, half, true);
  ray.outside_mm = crossing(hu, top, step_at(ray.edge_mm + kThickest_mm), half, false);
  if (std::isnan(ray.outside_mm)) return;
  const auto from = hu.begin() + static_cast<std::ptrdiff_t>(std::min(hu.size(), step_at(ray.outside_mm + 1)));
  const auto to = hu.begin() + static_cast<std::ptrdiff_t>(std::min(hu.size(), step_at(ray.outside_mm + kBeyond_mm)));
  if (from >= to) return;
  // As thin as the air inside: lung, round a bronchus, is not.
  const double mean = std::accumulate(from, to, 0.0) / static_cast<double>(to - from);
  ray.air_beyond = mean < air_hu + std::max(kLikeAir_hu, 0.1 * (hu[top] - air_hu)) &&
                   std::none_of(from, to, [half](double value) { return value > half; });
}

/// The value below which a share of the values lies.
double quantile(std::vector<double> values, double share) {
  if (values.empty()) return NAN;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

class Cavity {
 public:
  Cavity(const Volume& ct, double widest_mm, int directions)
      : ct_(ct),
        voxel_from_patient_(ct.patient_from_voxel.inverse()),
        widest_mm_(widest_mm),
        directions_(directions_of(directions)) {}

  [[nodiscard]] double widest_mm() const { return widest_mm_; }
  /// The share of the directions in which a wall is followed by open air.
  [[nodiscard]] double free() const {
    const auto count = std::count_if(rays_.begin(), rays_.end(), [](const Ray& ray) { return ray.air_beyond; });
    return static_cast<double>(count) / static_cast<double>(rays_.size());
  }

  /// Looks about from a place. False where that is in no cavity.
  bool look(const Vector3d& centre) {
    const double reach_mm = widest_mm_ + kThickest_mm + kBeyond_mm;
    const auto steps = step_at(reach_mm);
    const Vector3d start = voxel_from_patient_ * centre;
    const Vector3d size(ct_.size[0], ct_.size[1], ct_.size[2]);
    rays_.assign(directions_.size(), {});
    cut_ = false;
    double core = 0;
    int cores = 0;
    for (std::size_t d = 0; d < rays_.size(); ++d) {
      const Vector3d step = voxel_from_patient_.linear() * directions_[d] * kStep_mm;
      for (std::size_t n = 0; n < steps; ++n) {
        const Vector3d voxel = start + static_cast<double>(n) * step;
        if ((voxel.array() < -0.5).any() || (voxel.array() > size.array() - 0.5).any()) break;
        rays_[d].hu.push_back(sample(ct_, voxel));
        if (static_cast<double>(n) * kStep_mm > 1) continue;
        core += rays_[d].hu.back();
        ++cores;
      }
    }
    if (cores == 0) return false;
    air_hu_ = core / cores;
    std::vector<double> ridges;
    for (Ray& ray : rays_) {
      measure(ray, air_hu_, widest_mm_);
      if (std::isnan(ray.edge_mm)) cut_ = cut_ || ray.hu.size() < step_at(widest_mm_);
      if (!std::isnan(ray.ridge_mm)) ridges.push_back(ray.ridge_hu);
    }
    if (ridges.size() < rays_.size() / 2) return false;
    // Of a thin wall the blur leaves a part. The densest rays, down the stalk or a corner, have what is all wall.
    wall_hu_ = quantile(ridges, kDensest);
    find_rims(centre);
    return wall_hu_ - air_hu_ > kLeastContrast_hu;
  }

  /// From the place that look() was at to the centroid of what is missing in the wall, and its volume.
  std::pair<Vector3d, double> missing() {
    double volume = 0;
    Vector3d first = Vector3d::Zero();
    const double solid_angle = 4 * std::numbers::pi / static_cast<double>(rays_.size());
    effective_mm_.assign(rays_.size(), NAN);
    for (std::size_t d = 0; d < rays_.size(); ++d) {
      const Ray& ray = rays_[d];
      double limit_mm = std::fmin(ray.ridge_mm, crossing(ray.hu, 0, ray.hu.size(), wall_hu_, true));
      for (const Rim& rim : rims_) {
        const double along = directions_[d].dot(rim.outwards);
        if (along > 0) limit_mm = std::fmin(limit_mm, rim.height_mm / along);
      }
      if (std::isnan(limit_mm) || limit_mm > static_cast<double>(ray.hu.size() - 1) * kStep_mm) continue;
      double zeroth = 0;
      double along = 0;
      for (std::size_t n = 0; n < step_at(limit_mm); ++n) {
        const double r = (static_cast<double>(n) + 0.5) * kStep_mm;
        const double hu = 0.5 * (ray.hu[n] + ray.hu[n + 1]);
        const double share = (wall_hu_ - hu) / (wall_hu_ - air_hu_);
        zeroth += share * r * r * kStep_mm;
        along += share * r * r * r * kStep_mm;
      }
      effective_mm_[d] = std::cbrt(3 * std::max(0.0, zeroth));
      volume += zeroth * solid_angle;
      first += along * solid_angle * directions_[d];
    }
    return {first / std::max(volume, 1e-9), volume};
  }

  [[nodiscard]] HollowPost described(const Vector3d& centre, double volume_mm3) const {
    HollowPost post;
    post.centre_in_patient_mm = centre;
    post.cavity_mm = std::cbrt(6 / std::numbers::pi * std::max(0.0, volume_mm3));
    post.wall_hu = wall_hu_;
    post.contrast_hu = wall_hu_ - air_hu_;
    post.free = free();
    post.cut = cut_;
    post.endless = endless_;
    std::vector<double> widths;
    double odd = 0;
    int pairs = 0;
    const auto share = 1 / static_cast<double>(rays_.size());
    for (std::size_t d = 0; d < rays_.size(); ++d) {
      post.open += std::isnan(rays_[d].edge_mm) ? share : 0;
      if (d % 2 == 1) continue;
      const double width = rays_[d].outside_mm + rays_[d + 1].outside_mm;
      if (!std::isnan(width)) widths.push_back(width);
      const double difference = effective_mm_[d] - effective_mm_[d + 1];
      if (std::isnan(difference)) continue;
      odd += difference * difference / 4;
      ++pairs;
    }
    if (!widths.empty()) post.outer_mm = quantile(widths, 0.2);
    const double odd_mm = pairs > 0 ? std::sqrt(odd / pairs) : NAN;
    post.uneven = odd_mm / (post.cavity_mm / 2);
    // A cavity's edges lie alike on opposite sides. What is left of their difference, of which the centroid has taken
    // its part, tells of the noise and of voxels that are filled in part. The factors are measured on drawn posts.
    post.sigma_mm = std::hypot(0.5 * odd_mm, rims_.empty() ? 0.0 : kRimSigma_mm);
    return post;
  }

 private:
  /// The plane in which a cavity ends that is open.
  struct Rim {
    Vector3d outwards;
    double height_mm;  ///< over the place that was looked from
  };

  void find_rims(const Vector3d& centre) {
    rims_.clear();
    endless_ = false;
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (std::size_t d = 0; d < rays_.size(); ++d) {
      if (std::isnan(rays_[d].edge_mm)) spread += directions_[d] * directions_[d].transpose();
    }
    if (spread.isZero()) return;
    const Vector3d axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(2);
    for (const double side : {-1.0, 1.0}) {
      Vector3d open = Vector3d::Zero();
      int count = 0;
      for (std::size_t d = 0; d < rays_.size(); ++d) {
        if (!std::isnan(rays_[d].edge_mm) || side * directions_[d].dot(axis) < 0) continue;
        open += directions_[d];
        ++count;
      }
      if (count < kLeastOpen * static_cast<double>(rays_.size())) continue;
      const Vector3d outwards = open.normalized();
      const double height_mm = rim_height_mm(centre, outwards);
      if (std::isnan(height_mm)) {
        endless_ = true;
      } else {
        rims_.push_back({outwards, height_mm});
      }
    }
  }
  /// Where the middle of the wall ends, on the way outwards.
  [[nodiscard]] double rim_height_mm(const Vector3d& centre, const Vector3d& outwards) const {
    std::vector<double> radii;
    for (std::size_t d = 0; d < rays_.size(); ++d) {
      const double along = directions_[d].dot(outwards);
      if (std::abs(along) < 0.3 && !std::isnan(rays_[d].ridge_mm))
        radii.push_back(rays_[d].ridge_mm * std::sqrt(1 - along * along));
    }
    if (radii.empty()) return NAN;
    const double radius = quantile(radii, 0.5);
    const Vector3d side = outwards.unitOrthogonal();
    const Vector3d other = outwards.cross(side);
    std::vector<double> wall;
    for (std::size_t step = 0; step < step_at(widest_mm_); ++step) {
      constexpr int kRound = 48;
      const double height = static_cast<double>(step) * kStep_mm;
      double sum = 0;
      for (int n = 0; n < kRound; ++n) {
        const double angle = 2 * std::numbers::pi * n / kRound;
        const Vector3d p = centre + height * outwards + radius * (std::cos(angle) * side + std::sin(angle) * other);
        sum += sample(ct_, voxel_from_patient_ * p);
      }
      wall.push_back(sum / kRound);
    }
    return crossing(wall, 0, wall.size(), 0.5 * (wall.front() + air_hu_), false);
  }

  const Volume& ct_;
  const Eigen::Affine3d voxel_from_patient_;
  const double widest_mm_;
  const std::vector<Vector3d> directions_;
  std::vector<Ray> rays_;
  std::vector<double> effective_mm_;
  std::vector<Rim> rims_;
  double air_hu_ = 0, wall_hu_ = 0;
  bool cut_ = false, endless_ = false;
};

/// Moves from a place to the centroid of the cavity round it. Empty where there is none.
std::optional<HollowPost> settle(Cavity& cavity, const Vector3d& place, double settled_mm) {
  constexpr int kRounds = 12;
  Vector3d centre = place;
  double volume = 0;
  for (int round = 0; round < kRounds; ++round) {
    // Hardly any cavity of a body comes further.
    if (!cavity.look(centre) || cavity.free() < kLeastFree) return std::nullopt;
    const auto [off, missing_mm3] = cavity.missing();
    volume = missing_mm3;
    if (off.norm() < settled_mm) break;
    centre += off;
    if ((centre - place).norm() > cavity.widest_mm() / 2) return std::nullopt;
  }
  return cavity.described(centre, volume);
}

}  // namespace

std::optional<HollowPost> fit_hollow_post(const Volume& ct, const Vector3d& place_in_patient_mm, double widest_mm) {
  Cavity coarse(ct, widest_mm, kFewDirections);
  const auto rough = settle(coarse, place_in_patient_mm, 0.1);
  if (!rough) return std::nullopt;
  Cavity fine(ct, widest_mm, kDirections);
  return settle(fine, rough->centre_in_patient_mm, 0.01);
}

}  // namespace birdseye::host
