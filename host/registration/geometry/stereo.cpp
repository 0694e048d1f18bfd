#include "host/registration/geometry/stereo.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "host/registration/geometry/sight.hpp"

namespace birdseye::host {

namespace {

constexpr int kSide = 13;  ///< samples a side of a patch
/// Between samples, in pixels of a picture of 768; so large a patch in every picture, that it is as large on the organ.
constexpr double kBetween_px = 1.5, kWidth_px = 768;
constexpr int kMiddle = kSide / 2, kSamples = kSide * kSide;
constexpr double kLeastFacing = 0.25;  ///< cosine
constexpr float kLeastCorrelation = 0.6F, kLeastLead = 0.08F;
constexpr int kPeak = 4;               ///< steps to each side of a peak that are its own
constexpr double kLeastCommon = 0.85;  ///< share of a patch that both pictures show

/// From a patch's middle to sample i of it.
Eigen::Vector2d offset(int i) {
  const int column = i % kSide, row = i / kSide;
  return {column - kMiddle, row - kMiddle};
}

/// Bilinear; x and y at least 0 and less than one from the last. NaN beside a pixel that does not count.
float sample(const cv::Mat& picture, float x, float y) {
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const float s = x - static_cast<float>(column), t = y - static_cast<float>(row);
  const float* const upper = picture.ptr<float>(row) + column;
  const float* const lower = picture.ptr<float>(row + 1) + column;
  const float a = upper[0] + s * (upper[1] - upper[0]), b = lower[0] + s * (lower[1] - lower[0]);
  return a + t * (b - a);
}

/// A patch of one view and the plane that it is thought to lie in.
struct Patch {
  std::size_t view;
  double x_px, y_px, between_px, depth_mm;
  Eigen::Vector3d ray, place_mm, normal;
  std::array<float, kSamples> texture;  ///< NaN where it does not count
};

struct Found {
  Eigen::Vector3d place_mm, normal, from_camera;
  double sigma_mm;
};

class Sweep {
 public:
  Sweep(const std::vector<PinholeView>& views, const SeenSurface& surface, const StereoSettings& settings)
      : views_(views), surface_(surface), settings_(settings), sight_(surface, views, {kLeastFacing, 8, 10}) {}

  std::vector<Found> run() const {
    std::vector<std::pair<std::size_t, int>> rows;
    for (std::size_t v = 0; v < views_.size(); ++v) {
      for (int y = margin_px(views_[v]); y < views_[v].height_px - margin_px(views_[v]); y += grid_px(views_[v]))
        rows.emplace_back(v, y);
    }
    std::vector<std::vector<Found>> of_rows(rows.size());
    tbb::parallel_for(std::size_t{0}, rows.size(), [&](std::size_t n) {
      const auto [v, y] = rows[n];
      const PinholeView& view = views_[v];
      for (int x = margin_px(view); x < view.width_px - margin_px(view); x += grid_px(view)) {
        if (auto found = find(v, x, y)) of_rows[n].push_back(*found);
      }
    });
    std::vector<Found> out;
    for (const auto& row : of_rows) out.insert(out.end(), row.begin(), row.end());
    return out;
  }

 private:
  static double between_px(const PinholeView& view) { return kBetween_px * view.width_px / kWidth_px; }
  static int margin_px(const PinholeView& view) {
    constexpr int kBorder_px = 4;
    return static_cast<int>(std::ceil(between_px(view) * kMiddle)) + kBorder_px;
  }
  [[nodiscard]] int grid_px(const PinholeView& view) const {
    return std::max(1, static_cast<int>(std::lround(settings_.grid_px * view.width_px / kWidth_px)));
  }

  std::optional<Patch> patch_at(std::size_t v, int x, int y) const {
    const PinholeView& view = views_[v];
    if (view.usable.at<std::uint8_t>(y, x) == 0) return std::nullopt;
    if (!std::isfinite(sight_.depths(v).at(x, y))) return std::nullopt;
    Patch patch{};
    patch.view = v;
    patch.x_px = x;
    patch.y_px = y;
    patch.between_px = between_px(view);
    patch.ray = view.ray(x, y);
    const auto met = surface_.meet(view.eye_in_patient_mm, patch.ray);
    if (!met || met->distance_mm != 0) return std::nullopt;
    patch.depth_mm = met->depth_mm;
    patch.place_mm = view.eye_in_patient_mm + met->depth_mm * patch.ray;
    patch.normal = surface_.normal(patch.place_mm);
    if (-patch.normal.dot(patch.ray.normalized()) < kLeastFacing) return std::nullopt;
    int count = 0;
    for (int i = 0; i < kSamples; ++i) {
      const auto sx = static_cast<float>(x + patch.between_px * offset(i).x());
      const auto sy = static_cast<float>(y + patch.between_px * offset(i).y());
      const float value = sample(view.texture, sx, sy);
      patch.texture[static_cast<std::size_t>(i)] = value;
      if (!std::isnan(value)) ++count;
    }
    if (count < kLeastCommon * kSamples) return std::nullopt;
    return patch;
  }

  /// Normalised cross-correlation of the patch with the other view where its plane is moved to a depth.
  float correlation(const Patch& patch, const PinholeView& other, double depth_mm) const {
    const PinholeView& view = views_[patch.view];
    // Of the plane n . (p - eye) = d, the places of the view's pixels, seen by the other.
    const double d = patch.normal.dot(patch.ray) * depth_mm;
    const Eigen::Matrix3d rotation = other.camera_from_patient.rotation();
    const Eigen::Vector3d apart = other.camera_from_patient * view.eye_in_patient_mm;
    Eigen::Matrix3d lens;
    lens << other.fx_px, 0, other.cx_px, 0, other.fy_px, other.cy_px, 0, 0, 1;
    Eigen::Matrix3d ray_of;  // of (x, y, 1)
    ray_of << 1 / view.fx_px, 0, -view.cx_px / view.fx_px, 0, 1 / view.fy_px, -view.cy_px / view.fy_px, 0, 0, 1;
    ray_of = view.camera_from_patient.rotation().transpose() * ray_of;
    const Eigen::Matrix3f h =
        (lens * (rotation * ray_of + apart * (patch.normal.transpose() * ray_of) / d)).cast<float>();
    float count = 0, sum_a = 0, sum_b = 0, sum_aa = 0, sum_bb = 0, sum_ab = 0;
    const auto most_x = static_cast<float>(other.width_px - 2), most_y = static_cast<float>(other.height_px - 2);
    for (int i = 0; i < kSamples; ++i) {
      const auto x = static_cast<float>(patch.x_px + patch.between_px * offset(i).x());
      const auto y = static_cast<float>(patch.y_px + patch.between_px * offset(i).y());
      const float w = h(2, 0) * x + h(2, 1) * y + h(2, 2);
      const float u = (h(0, 0) * x + h(0, 1) * y + h(0, 2)) / w, v = (h(1, 0) * x + h(1, 1) * y + h(1, 2)) / w;
      if (!(u >= 0 && v >= 0 && u < most_x && v < most_y)) continue;
      const float a = patch.texture[static_cast<std::size_t>(i)], b = sample(other.texture, u, v);
      if (std::isnan(a + b)) continue;
      count += 1;
      sum_a += a;
      sum_b += b;
      sum_aa += a * a;
      sum_bb += b * b;
      sum_ab += a * b;
    }
    if (count < static_cast<float>(kLeastCommon) * kSamples) return std::numeric_limits<float>::quiet_NaN();
    // Both are about 0 in the mean, so that little is lost by taking the means off at the end.
    const float aa = sum_aa - sum_a * sum_a / count, bb = sum_bb - sum_b * sum_b / count;
    constexpr float kFlat = 1e-6F;
    if (aa < kFlat * count || bb < kFlat * count) return 0;
    return (sum_ab - sum_a * sum_b / count) / std::sqrt(aa * bb);
  }

  std::optional<Found> find(std::size_t v, int x, int y) const {
    const auto patch = patch_at(v, x, y);
    if (!patch) return std::nullopt;
    const int half = static_cast<int>(std::lround(settings_.span_mm / settings_.step_mm));
    const std::size_t steps = 2 * static_cast<std::size_t>(half) + 1;
    std::vector<float> score(steps, 0);
    std::vector<int> seen(steps, 0);
    for (std::size_t w = 0; w < views_.size(); ++w) {
      if (w == v || !sight_.sees(w, patch->place_mm)) continue;
      for (std::size_t s = 0; s < steps; ++s) {
        const double depth = patch->depth_mm + (static_cast<int>(s) - half) * settings_.step_mm;
        if (depth <= 0) continue;
        const float r = correlation(*patch, views_[w], depth);
        if (!std::isfinite(r)) continue;
        score[s] += r;
        ++seen[s];
      }
    }
    for (std::size_t s = 0; s < steps; ++s) score[s] = seen[s] > 0 ? score[s] / static_cast<float>(seen[s]) : -1;
    const auto best = static_cast<int>(std::max_element(score.begin(), score.end()) - score.begin());
    const auto at = [&](int s) { return score[static_cast<std::size_t>(s)]; };
    if (at(best) < kLeastCorrelation || best == 0 || best == 2 * half) return std::nullopt;
    for (int s = 0; s <= 2 * half; ++s) {
      if (std::abs(s - best) > kPeak && at(s) > at(best) - kLeastLead) return std::nullopt;
    }
    const float bend = std::max(1e-6F, 2 * at(best) - at(best - 1) - at(best + 1));
    const double between = std::clamp(0.5 * static_cast<double>((at(best + 1) - at(best - 1)) / bend), -0.5, 0.5);
    const double depth = patch->depth_mm + (best - half + between) * settings_.step_mm;
    // The flatter the peak and the less alike the patches, the less is known; of stereo on simulated organs, where the
    // truth is known, 0.45 of it and what it says nothing of.
    constexpr double kOfPeak = 0.45, kBeside_mm = 0.08;
    const double facing = -patch->normal.dot(patch->ray);
    const double of_peak_mm = settings_.step_mm * facing * std::sqrt(static_cast<double>((1 - at(best)) / bend));
    const double sigma_mm = std::hypot(kOfPeak * of_peak_mm, kBeside_mm);
    return Found{views_[v].eye_in_patient_mm + depth * patch->ray, patch->normal, patch->ray.normalized(), sigma_mm};
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
    if (keep[i]) out.push_back({found[i].place_mm, found[i].sigma_mm, found[i].from_camera});
  }
  return out;
}

}  // namespace birdseye::host
