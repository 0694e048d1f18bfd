#include "host/registration/geometry/texture_matches.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "host/registration/geometry/parabola.hpp"
#include "host/registration/geometry/patch.hpp"
#include "host/registration/geometry/sight.hpp"

namespace birdseye::host {

namespace {

constexpr double kStep_px = 1.5;
constexpr double kLeastAlong = 0.574;  ///< cosine of 55 degrees between the views' rays
constexpr std::size_t kMostOthers = 2;
constexpr float kLeastCorrelation = 0.6F, kLeastLead = 0.1F;

struct Peak {
  double along = 0, beside = 0;  ///< steps
  float score = -1;
};

/// Which matches are as far from the ray as a good part of those of the same two views.
std::vector<bool> off_alike(std::span<const TextureMatch> matches) {
  constexpr double kPart = 0.3;
  std::vector<bool> out;
  for (const TextureMatch& match : matches) {
    double of_views = 0, alike = 0;
    for (const TextureMatch& other : matches) {
      if (other.view != match.view || other.other_view != match.other_view) continue;
      of_views += 1;
      if (std::abs(other.beside_px - match.beside_px) < kOffAlike_px) alike += 1;
    }
    out.push_back(alike >= kPart * of_views);
  }
  return out;
}

/// Scores of shifts on a grid about none.
class Scores {
 public:
  Scores(int along, int beside)
      : along_(along), beside_(beside), scores_(Eigen::ArrayXXf::Constant(2 * along + 1, 2 * beside + 1, -1)) {}

  float& at(int along, int beside) { return scores_(along + along_, beside + beside_); }
  [[nodiscard]] std::pair<int, int> best() const {
    Eigen::Index s = 0, b = 0;
    scores_.maxCoeff(&s, &b);
    return {static_cast<int>(s) - along_, static_cast<int>(b) - beside_};
  }
  [[nodiscard]] int along() const { return along_; }
  [[nodiscard]] int beside() const { return beside_; }

 private:
  int along_, beside_;
  Eigen::ArrayXXf scores_;
};

/// The highest score, if it is within the grid and none beside its own is nearly as high.
std::optional<Peak> peak_of(Scores& scores) {
  constexpr double kOwn = 4.5;
  const auto [s, b] = scores.best();
  Peak best{static_cast<double>(s), static_cast<double>(b), scores.at(s, b)};
  if (best.score < kLeastCorrelation || std::abs(s) == scores.along() || std::abs(b) == scores.beside())
    return std::nullopt;
  for (int i = -scores.along(); i <= scores.along(); ++i) {
    for (int j = -scores.beside(); j <= scores.beside(); ++j) {
      if (std::hypot(i - s, j - b) > kOwn && scores.at(i, j) > best.score - kLeastLead) return std::nullopt;
    }
  }
  best.along += peak_between(scores.at(s - 1, b), best.score, scores.at(s + 1, b));
  best.beside += peak_between(scores.at(s, b - 1), best.score, scores.at(s, b + 1));
  return best;
}

class Search {
 public:
  Search(const std::vector<PinholeView>& views, const SeenSurface& surface, const MatchSettings& settings)
      : views_(views), surface_(surface), settings_(settings), sight_(surface, views, {kPatchFacing, 8, 10}) {}

  TextureMatches run() const {
    const std::vector<GridPixel> pixels = patch_grid(views_, settings_.grid_px);
    std::vector<TextureMatches> of_pixels(pixels.size());
    tbb::parallel_for(std::size_t{0}, pixels.size(), [&](std::size_t n) { of_pixels[n] = look_for(pixels[n]); });
    TextureMatches out;
    std::vector<TextureMatch> all;
    for (std::size_t n = 0; n < pixels.size(); ++n) {
      out.looked_for += of_pixels[n].looked_for;
      for (TextureMatch match : of_pixels[n].found) {
        match.place = n;
        all.push_back(match);
      }
    }
    const std::vector<bool> keep = off_alike(all);
    std::size_t places = 0, last = pixels.size();
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!keep[i]) continue;
      if (all[i].place != last) ++places;
      last = all[i].place;
      out.found.push_back(all[i]);
      out.found.back().place = places - 1;
    }
    return out;
  }

 private:
  /// The views that see the place from nearly the same side, the nearest first.
  std::vector<std::size_t> others_of(std::size_t v, const Patch& patch) const {
    std::vector<std::pair<double, std::size_t>> by_cosine;
    for (std::size_t w = 0; w < views_.size(); ++w) {
      if (w == v || !sight_.sees(w, patch.place_mm)) continue;
      const double cosine = patch.ray.normalized().dot((patch.place_mm - views_[w].eye_in_patient_mm).normalized());
      if (cosine > kLeastAlong) by_cosine.emplace_back(-cosine, w);
    }
    std::sort(by_cosine.begin(), by_cosine.end());
    std::vector<std::size_t> out;
    for (std::size_t i = 0; i < std::min(kMostOthers, by_cosine.size()); ++i) out.push_back(by_cosine[i].second);
    return out;
  }

  TextureMatches look_for(const GridPixel& pixel) const {
    TextureMatches out;
    const auto patch = patch_at(views_[pixel.view], sight_.depths(pixel.view), surface_, pixel.x_px, pixel.y_px);
    if (!patch) return out;
    for (const std::size_t w : others_of(pixel.view, *patch)) {
      ++out.looked_for;
      if (auto match = found_in(*patch, views_[w])) {
        match->view = pixel.view;
        match->other_view = w;
        out.found.push_back(*match);
      }
    }
    return out;
  }

  std::optional<TextureMatch> found_in(const Patch& patch, const PinholeView& other) const {
    constexpr double kLeastStep_mm = 0.4, kMostStep_mm = 2;
    const PinholeView& view = *patch.view;
    const auto pixel_at = [&](double depth_mm) -> Eigen::Vector2d {
      const auto pixel = other.project(view.eye_in_patient_mm + depth_mm * patch.ray);
      return {pixel.x_px, pixel.y_px};
    };
    const double step_px = kStep_px * other.width_px / kReferenceWidth_px;
    const Eigen::Vector2d along_px = pixel_at(patch.depth_mm + 0.5) - pixel_at(patch.depth_mm - 0.5);
    const double step_mm = std::clamp(step_px / std::max(along_px.norm(), 1e-6), kLeastStep_mm, kMostStep_mm);
    const Eigen::Vector2d beside_px = step_px * Eigen::Vector2d(-along_px.y(), along_px.x()).normalized();
    Scores scores(static_cast<int>(settings_.span_mm / step_mm), static_cast<int>(settings_.beside_px / kStep_px));
    const PatchSeenBy seen_by(patch, other);
    const auto look_at = [&](int s, int b) {
      const double depth_mm = patch.depth_mm + s * step_mm;
      if (depth_mm <= 0) return;
      const float score = seen_by.correlation(depth_mm, b * beside_px);
      if (std::isfinite(score)) scores.at(s, b) = score;
    };
    // Every other shift along each axis, which no peak slips through, then all about the best.
    const auto even = [](int n) { return n - n % 2; };
    for (int s = -even(scores.along()); s <= scores.along(); s += 2) {
      for (int b = -even(scores.beside()); b <= scores.beside(); b += 2) look_at(s, b);
    }
    const auto [near_s, near_b] = scores.best();
    for (int s = std::max(-scores.along(), near_s - 2); s <= std::min(scores.along(), near_s + 2); ++s) {
      for (int b = std::max(-scores.beside(), near_b - 2); b <= std::min(scores.beside(), near_b + 2); ++b) {
        if (s % 2 != 0 || b % 2 != 0) look_at(s, b);
      }
    }
    // The height of the peak's sides tells how far between two shifts it lies.
    const auto [best_s, best_b] = scores.best();
    for (const auto& [s, b] :
         {std::pair{best_s - 1, best_b}, {best_s + 1, best_b}, {best_s, best_b - 1}, {best_s, best_b + 1}}) {
      if (std::abs(s) <= scores.along() && std::abs(b) <= scores.beside()) look_at(s, b);
    }
    const auto peak = peak_of(scores);
    if (!peak) return std::nullopt;
    TextureMatch match;
    match.at_px = {patch.x_px, patch.y_px};
    match.depth_mm = patch.depth_mm + peak->along * step_mm;
    match.other_px = pixel_at(match.depth_mm) + peak->beside * beside_px;
    match.beside_px = peak->beside * kStep_px;
    return match;
  }

  const std::vector<PinholeView>& views_;
  const SeenSurface& surface_;
  const MatchSettings& settings_;
  Sight sight_;
};

}  // namespace

TextureMatches texture_matches(const std::vector<PinholeView>& views, const SeenSurface& surface,
                               const MatchSettings& settings) {
  return Search(views, surface, settings).run();
}

}  // namespace birdseye::host
