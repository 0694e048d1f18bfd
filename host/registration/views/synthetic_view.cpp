#include "host/registration/views/synthetic_view.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "host/registration/views/point_light.hpp"

namespace birdseye::host {

namespace {

constexpr int kBrick = 4;
constexpr float kGone = 1e-5F;       ///< a ray ends where so little light is left
constexpr float kSoft_steps = 1.5F;  ///< a ray that goes straight in is stopped within twice as many of its steps
constexpr int kBands = 4;            ///< of a view's rays, each with sums of its own: the same for any threads

std::size_t at(std::int64_t value) {
  return static_cast<std::size_t>(value);
}

float lerp(float a, float b, float t) {
  return a + t * (b - a);
}

/// Of the light, what a ray that has been so deep has lost, and its derivative by the depth.
struct Stopped {
  float share, by_depth;
};
Stopped stopped_at(float depth_mm, float soft_mm) {
  const float x = std::clamp(0.5F * (depth_mm / soft_mm + 1), 0.0F, 1.0F);
  return {x * x * (3 - 2 * x), 3 * x * (1 - x) / soft_mm};
}

}  // namespace

SyntheticView::SyntheticView(const VideoView& view, const Tissue& tissue, int reduction)
    : tissue_(tissue), camera_from_patient_(view.camera_from_patient) {
  step_mm_ = static_cast<float>(0.5 * tissue.spacing_mm.minCoeff());
  soft_mm_ = kSoft_steps * step_mm_;
  const int columns = view.camera.width_px / reduction, rows = view.camera.height_px / reduction;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      int sum = 0, count = 0;
      for (int y = row * reduction; y < (row + 1) * reduction; ++y) {
        for (int x = column * reduction; x < (column + 1) * reduction; ++x) {
          const std::size_t pixel = at(std::int64_t{y} * view.camera.width_px + x);
          if (view.mask[pixel] == 0) continue;
          sum += view.grey[pixel];
          ++count;
        }
      }
      if (count == 0 || 2 * count <= reduction * reduction) continue;
      const double middle = 0.5 * (reduction - 1);
      const auto direction =
          unproject(view.camera, Eigen::Vector2d(column * reduction + middle, row * reduction + middle));
      if (!direction) continue;
      Ray ray{};
      ray.radius2 = static_cast<float>(direction->head<2>().squaredNorm());
      rays_.push_back(ray);
      directions_in_camera_.push_back(direction->normalized());
      video_.push_back(static_cast<std::uint8_t>((sum + count / 2) / count));
    }
  }
  float rim = 1e-6F;
  for (const Ray& ray : rays_) rim = std::max(rim, ray.radius2);
  for (Ray& ray : rays_) ray.radius2 /= rim;
  look_from({});
  // As bright as can be a little nearer than the nearest tissue, which may still move.
  double nearest_mm = 1e9;
  for (int z = 0; z < tissue.points[2]; ++z) {
    for (int y = 0; y < tissue.points[1]; ++y) {
      for (int x = 0; x < tissue.points[0]; ++x) {
        if (tissue.depth_mm[grid_index(tissue.points, x, y, z)] <= 0) continue;
        nearest_mm = std::min(nearest_mm, (Eigen::Vector3d(x, y, z).cwiseProduct(tissue.spacing_mm) - eye_mm_).norm());
      }
    }
  }
  typical_mm_ = std::max(1.0, 0.85 * nearest_mm);
  grey_.resize(video_.size());
  points_.resize(grid_count(tissue.points));
  for (std::size_t axis = 0; axis < 3; ++axis) brick_count_[axis] = (tissue.points[axis] - 2) / kBrick + 1;
  bands_.resize(kBands);
  for (std::size_t n = 0; n < kBands; ++n) {
    bands_[n].first = rays_.size() * n / kBands;
    bands_[n].last = rays_.size() * (n + 1) / kBands;
  }
}

void SyntheticView::look_from(const Transform<Patient, Patient>& patient_from_model) {
  const Transform<Patient, Camera> model_from_camera = (camera_from_patient_ * patient_from_model).inverse();
  const Eigen::Affine3d grid_from_patient = tissue_.patient_from_grid.inverse();
  eye_mm_ = grid_from_patient * model_from_camera.translation();
  grid_from_camera_ = grid_from_patient.linear() * model_from_camera.rotation();
  const Eigen::Vector3d per_mm = tissue_.spacing_mm.cwiseInverse();
  for (std::size_t r = 0; r < rays_.size(); ++r) {
    Ray& ray = rays_[r];
    const Eigen::Vector3d d = grid_from_camera_ * directions_in_camera_[r];
    double near = 1, far = 1e9;
    for (int axis = 0; axis < 3; ++axis) {
      const double o = eye_mm_[axis] * per_mm[axis], v = d[axis] * per_mm[axis];
      ray.origin[axis] = static_cast<float>(o);
      ray.direction[axis] = static_cast<float>(std::abs(v) < 1e-9 ? 1e-9 : v);
      const double a = -o / static_cast<double>(ray.direction[axis]);
      const double b = (tissue_.points[at(axis)] - 1 - o) / static_cast<double>(ray.direction[axis]);
      near = std::max(near, std::min(a, b));
      far = std::min(far, std::max(a, b));
    }
    ray.near_mm = static_cast<float>(near);
    ray.far_mm = static_cast<float>(far);
  }
}

/// Whether a sample that meets tissue may be blended with this point's light.
bool SyntheticView::beside_tissue(int x, int y, int z) const {
  const int p[3] = {x, y, z};
  int low[3], high[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = std::max(0, p[axis] - 1) / kBrick;
    high[axis] = std::min(p[axis], tissue_.points[axis] - 2) / kBrick;
  }
  for (int k = low[2]; k <= high[2]; ++k) {
    for (int j = low[1]; j <= high[1]; ++j) {
      for (int i = low[0]; i <= high[0]; ++i) {
        if (bricks_[grid_index(brick_count_, i, j, k)] != 0) return true;
      }
    }
  }
  return false;
}

void SyntheticView::light_points(const std::vector<float>& depth_mm, const Headlight& light) {
  light_ = light;
  const Lamp lamp(light_, eye_mm_ + grid_from_camera_ * light_.offset_in_camera_mm, typical_mm_);
  const auto& n = tissue_.points;
  tbb::parallel_for(0, n[2], [&](int z) {
    for (int y = 0; y < n[1]; ++y) {
      for (int x = 0; x < n[0]; ++x) {
        const std::size_t v = grid_index(n, x, y, z);
        points_[v] = {depth_mm[v], 0};
        if (!beside_tissue(x, y, z)) continue;
        points_[v].shade = light_point(tissue_, depth_mm, lamp, x, y, z).shading.value;
      }
    }
  });
}

void SyntheticView::find_empty_bricks(const std::vector<float>& depth_mm) {
  // The sample before the first that stops light is needed too; tissue that is squeezed rises faster than 1 mm a mm.
  const float empty_mm = -soft_mm_ - 2 * step_mm_;
  const auto& n = tissue_.points;
  bricks_.assign(grid_count(brick_count_), 0);
  tbb::parallel_for(0, brick_count_[2], [&](int bz) {
    for (int z = bz * kBrick; z <= std::min(bz * kBrick + kBrick, n[2] - 1); ++z) {
      for (int y = 0; y < n[1]; ++y) {
        const float* const row = &depth_mm[grid_index(n, 0, y, z)];
        for (int x = 0; x < n[0]; ++x) {
          if (row[x] <= empty_mm) continue;
          // A point belongs to the cells on both sides of it.
          for (const int by : {std::max(0, y - 1) / kBrick, std::min(y, n[1] - 2) / kBrick}) {
            bricks_[grid_index(brick_count_, std::max(0, x - 1) / kBrick, by, bz)] = 1;
            bricks_[grid_index(brick_count_, std::min(x, n[0] - 2) / kBrick, by, bz)] = 1;
          }
        }
      }
    }
  });
}

SyntheticView::Sample SyntheticView::sample_at(const Ray& ray, int step, std::array<int, 3>& brick) const {
  const auto& n = tissue_.points;
  const float s = static_cast<float>(step) * step_mm_;
  Sample sample{};
  int base[3];
  for (int axis = 0; axis < 3; ++axis) {
    const float x = std::clamp(ray.origin[axis] + s * ray.direction[axis], 0.0F, static_cast<float>(n[at(axis)] - 1));
    base[axis] = std::min(static_cast<int>(x), n[at(axis)] - 2);
    sample.t[axis] = x - static_cast<float>(base[axis]);
    brick[at(axis)] = base[axis] / kBrick;
  }
  sample.base = static_cast<std::uint32_t>(grid_index(n, base[0], base[1], base[2]));
  return sample;
}

float SyntheticView::blend(const Sample& sample, float Point::*of) const {
  const std::size_t row = at(tissue_.points[0]), slice = row * at(tissue_.points[1]);
  const Point* const p = &points_[sample.base];
  const auto along_x = [&](std::size_t offset) { return lerp(p[offset].*of, p[offset + 1].*of, sample.t[0]); };
  return lerp(lerp(along_x(0), along_x(row), sample.t[1]), lerp(along_x(slice), along_x(slice + row), sample.t[1]),
              sample.t[2]);
}

int SyntheticView::steps_to_leave(const Ray& ray, int step, const std::array<int, 3>& brick) const {
  const float s = static_cast<float>(step) * step_mm_;
  float out_mm = 1e9F;
  for (int axis = 0; axis < 3; ++axis) {
    const int face = ray.direction[axis] > 0 ? brick[at(axis)] + 1 : brick[at(axis)];
    const float x =
        std::clamp(ray.origin[axis] + s * ray.direction[axis], 0.0F, static_cast<float>(tissue_.points[at(axis)] - 1));
    out_mm = std::min(out_mm, (static_cast<float>(face * kBrick) - x) / ray.direction[axis]);
  }
  return 1 + static_cast<int>(std::max(0.0F, out_mm) / step_mm_ * (1 - 1e-5F));
}

void SyntheticView::cast(Band& band) {
  band.samples.clear();
  band.ends.clear();
  for (std::size_t r = band.first; r < band.last; ++r) {
    const Ray& ray = rays_[r];
    float stopped = 0;
    double grey = 0;
    auto step = static_cast<int>(std::ceil(ray.near_mm / step_mm_));
    const auto end = static_cast<int>(std::floor(ray.far_mm / step_mm_));
    // The sample a step before, if there was one, and whether it is among the band's.
    Sample before{};
    bool follows = false, kept = false;
    while (step <= end) {
      std::array<int, 3> brick;
      Sample sample = sample_at(ray, step, brick);
      if (bricks_[grid_index(brick_count_, brick[0], brick[1], brick[2])] == 0) {
        step += steps_to_leave(ray, step, brick);
        follows = false;
        continue;
      }
      ++step;
      const auto [share, by_depth] = stopped_at(blend(sample, &Point::depth_mm), soft_mm_);
      if (share <= stopped) {
        before = sample;
        follows = true;
        kept = false;
        continue;
      }
      if (follows && !kept) {
        before.shade = blend(before, &Point::shade);
        band.samples.push_back(before);
      }
      sample.shade = blend(sample, &Point::shade);
      sample.by_depth = by_depth;
      sample.stops = share - stopped;
      sample.follows = follows;
      grey += static_cast<double>(sample.stops * (follows ? 0.5F * (before.shade + sample.shade) : sample.shade));
      stopped = share;
      band.samples.push_back(sample);
      before = sample;
      follows = kept = true;
      if (stopped > 1 - kGone) break;
    }
    band.ends.push_back(static_cast<std::uint32_t>(band.samples.size()));
    const double lens = std::pow(1 - light_.vignette * static_cast<double>(ray.radius2), kGamma);
    grey_[r] = lens * grey + static_cast<double>(1 - stopped) * kBackground;
  }
}

std::size_t SyntheticView::tissue_pixels() const {
  return static_cast<std::size_t>(
      std::count_if(grey_.begin(), grey_.end(), [](double grey) { return grey > 0.5 * kBackground; }));
}

const std::vector<double>& SyntheticView::render(const std::vector<float>& depth_mm, const Headlight& light) {
  find_empty_bricks(depth_mm);
  light_points(depth_mm, light);
  tbb::parallel_for(std::size_t{0}, bands_.size(), [&](std::size_t n) { cast(bands_[n]); });
  return grey_;
}

void SyntheticView::pull_back_band(Band& band, const std::vector<double>& by_grey, bool rays_too) {
  const auto& n = tissue_.points;
  const std::size_t row = at(n[0]), slice = row * at(n[1]);
  const Eigen::Vector3d per_mm = tissue_.spacing_mm.cwiseInverse();
  band.adjoint.assign(points_.size(), Point{0, 0});
  band.on_rays = {};
  std::size_t begin = 0;
  for (std::size_t r = band.first; r < band.last; ++r) {
    const std::size_t end = band.ends[r - band.first];
    const auto scale = static_cast<float>(by_grey[r]);
    const auto lens = static_cast<float>(std::pow(1 - light_.vignette * static_cast<double>(rays_[r].radius2), kGamma));
    // What is seen where a sample lets light through that all before it let through, and what the next one wants of the
    // shade of this one.
    float behind = static_cast<float>(kBackground), by_shared_shade = 0;
    for (std::size_t i = end; i-- > begin;) {
      const Sample& s = band.samples[i];
      float by_depth = 0, by_shade = by_shared_shade;
      by_shared_shade = 0;
      if (s.stops > 0) {
        const float lit = lens * (s.follows ? 0.5F * (band.samples[i - 1].shade + s.shade) : s.shade);
        by_depth = scale * (lit - behind) * s.by_depth;
        behind = lit;
        const float by_lit = scale * lens * s.stops;
        by_shade += s.follows ? 0.5F * by_lit : by_lit;
        if (s.follows) by_shared_shade = 0.5F * by_lit;
      }
      Point* const p = &band.adjoint[s.base];
      const float wx[2] = {1 - s.t[0], s.t[0]}, wy[2] = {1 - s.t[1], s.t[1]}, wz[2] = {1 - s.t[2], s.t[2]};
      for (std::size_t k = 0; k < 2; ++k) {
        for (std::size_t j = 0; j < 2; ++j) {
          const float w = wy[j] * wz[k];
          Point* const q = p + k * slice + j * row;
          for (std::size_t m = 0; m < 2; ++m) {
            q[m].depth_mm += w * wx[m] * by_depth;
            q[m].shade += w * wx[m] * by_shade;
          }
        }
      }
      if (!rays_too) continue;
      // The sample's own motion: the slopes of the blend of its cell.
      const Point* const cell = &points_[s.base];
      float slope[3] = {0, 0, 0};
      for (std::size_t k = 0; k < 2; ++k) {
        for (std::size_t j = 0; j < 2; ++j) {
          for (std::size_t m = 0; m < 2; ++m) {
            const Point& corner = cell[k * slice + j * row + m];
            const float value = by_depth * corner.depth_mm + by_shade * corner.shade;
            slope[0] += m == 1 ? wy[j] * wz[k] * value : -wy[j] * wz[k] * value;
            slope[1] += j == 1 ? wx[m] * wz[k] * value : -wx[m] * wz[k] * value;
            slope[2] += k == 1 ? wx[m] * wy[j] * value : -wx[m] * wy[j] * value;
          }
        }
      }
      const std::size_t x = s.base % row, y = s.base % slice / row, z = s.base / slice;
      const Eigen::Vector3d place(static_cast<double>(x) + static_cast<double>(s.t[0]),
                                  static_cast<double>(y) + static_cast<double>(s.t[1]),
                                  static_cast<double>(z) + static_cast<double>(s.t[2]));
      band.on_rays.add(place.cwiseProduct(tissue_.spacing_mm),
                       Eigen::Vector3f(slope[0], slope[1], slope[2]).cast<double>().cwiseProduct(per_mm));
    }
    begin = end;
  }
}

void SyntheticView::pull_back_light(const std::vector<float>& depth_mm, const std::vector<float>& by_shade,
                                    std::vector<float>& by_depth, Wrench* on_lamp) const {
  const Lamp lamp(light_, eye_mm_ + grid_from_camera_ * light_.offset_in_camera_mm, typical_mm_);
  const auto& n = tissue_.points;
  for (int z = 0; z < n[2]; ++z) {
    for (int y = 0; y < n[1]; ++y) {
      for (int x = 0; x < n[0]; ++x) {
        const std::size_t v = grid_index(n, x, y, z);
        if (by_shade[v] == 0 || points_[v].shade == 0) continue;
        const auto [s, shading, to, l, r2] = light_point(tissue_, depth_mm, lamp, x, y, z);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const float by = by_shade[v] * shading.by_gradient[axis] * s.per_mm[axis];
          by_depth[s.high[axis]] += by;
          by_depth[s.low[axis]] -= by;
        }
        if (on_lamp == nullptr) continue;
        // The way to the point, to, is from the lamp: it turns, and the light falls off along it.
        const Eigen::Vector3f by_l(shading.by_to_lamp);
        Eigen::Vector3f by_to = (by_l - by_l.dot(l) * l) / std::sqrt(r2);
        if (r2 > 1) by_to += 2 * lamp.fall_power * shading.value / r2 * to;
        on_lamp->add(lamp.place_mm, -static_cast<double>(by_shade[v]) * by_to.cast<double>());
      }
    }
  }
}

void SyntheticView::pull_back(const std::vector<float>& depth_mm, const std::vector<double>& by_grey,
                              std::vector<float>& by_depth, Wrench* on_camera) {
  tbb::parallel_for(std::size_t{0}, bands_.size(),
                    [&](std::size_t n) { pull_back_band(bands_[n], by_grey, on_camera != nullptr); });
  std::vector<float> by_shade(points_.size(), 0.0F);
  for (const Band& band : bands_) {
    for (std::size_t v = 0; v < points_.size(); ++v) {
      by_depth[v] += band.adjoint[v].depth_mm;
      by_shade[v] += band.adjoint[v].shade;
    }
  }
  if (on_camera != nullptr) {
    for (const Band& band : bands_) *on_camera += band.on_rays;
  }
  pull_back_light(depth_mm, by_shade, by_depth, on_camera);
}

}  // namespace birdseye::host
