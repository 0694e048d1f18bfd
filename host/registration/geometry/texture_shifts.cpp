#include "host/registration/geometry/texture_shifts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "host/registration/geometry/parabola.hpp"

namespace birdseye::host {

namespace {

constexpr int kHalf_px = 8, kSide_px = 2 * kHalf_px + 1;  ///< of a patch, in the later view
constexpr int kAcross = 38;                               ///< places of a grid across the picture
constexpr std::size_t kMostPairs = 350;                   ///< of a place and a view
constexpr std::size_t kMostViews = 2;                     ///< earlier ones that a place is looked for by, the nearest
constexpr double kLeastFacing = 0.3;                      ///< cosine
constexpr double kLeastAlong = 0.819;                     ///< cosine of 35 degrees between the views' rays
constexpr double kLeastUsable = 0.95;                     ///< share of a patch
constexpr double kNearest_mm = 20;                        ///< nearer, a mm is too many pixels to look through

bool shown_by(const PinholeView& view, double x_px, double y_px) {
  constexpr int kBorder_px = 2;
  const int column = static_cast<int>(std::lround(x_px)), row = static_cast<int>(std::lround(y_px));
  return column >= kBorder_px && row >= kBorder_px && column < view.width_px - kBorder_px &&
         row < view.height_px - kBorder_px && view.usable.at<std::uint8_t>(row, column) != 0;
}

/// A small plane of the surface.
struct Place {
  Eigen::Vector2d at_px;
  double depth_mm;
  Eigen::Vector3d place_mm, normal;
};

std::optional<Place> place_at(const PinholeView& now, const SeenSurface& surface, int x_px, int y_px) {
  if (!shown_by(now, x_px, y_px)) return std::nullopt;
  const Eigen::Vector3d ray = now.ray(x_px, y_px);
  const auto met = surface.meet(now.eye_in_patient_mm, ray);
  if (!met || met->distance_mm != 0 || met->depth_mm < kNearest_mm) return std::nullopt;
  const Eigen::Vector3d place_mm = now.eye_in_patient_mm + met->depth_mm * ray;
  const Eigen::Vector3d normal = surface.normal(place_mm);
  if (-normal.dot(ray.normalized()) < kLeastFacing) return std::nullopt;
  return Place{{x_px, y_px}, met->depth_mm, place_mm, normal};
}

/// The cosine between the rays of both views; empty where the earlier one does not see the place, or from another side.
std::optional<double> alongside(const EarlierView& earlier, const PinholeView& now, const Place& place) {
  constexpr double kBehind_mm = 5;
  const PinholeView& view = earlier.view;
  const auto pixel = view.project(place.place_mm);
  if (!(pixel.depth_mm > 0) || !shown_by(view, pixel.x_px, pixel.y_px)) return std::nullopt;
  const double depth_mm = static_cast<double>(earlier.depths.at(pixel.x_px, pixel.y_px));
  if (!std::isfinite(depth_mm) || depth_mm < pixel.depth_mm - kBehind_mm) return std::nullopt;
  const Eigen::Vector3d to_earlier = (view.eye_in_patient_mm - place.place_mm).normalized();
  const double cosine = to_earlier.dot((now.eye_in_patient_mm - place.place_mm).normalized());
  if (cosine < kLeastAlong || place.normal.dot(to_earlier) < kLeastFacing) return std::nullopt;
  return cosine;
}

std::vector<const EarlierView*> nearest_to(const std::vector<EarlierView>& earlier, const PinholeView& now,
                                           const Place& place) {
  std::vector<std::pair<double, const EarlierView*>> by_cosine;
  for (const EarlierView& one : earlier) {
    if (const auto cosine = alongside(one, now, place)) by_cosine.emplace_back(*cosine, &one);
  }
  std::stable_sort(by_cosine.begin(), by_cosine.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<const EarlierView*> out;
  for (std::size_t i = 0; i < std::min(kMostViews, by_cosine.size()); ++i) out.push_back(by_cosine[i].second);
  return out;
}

/// A place of a grid over the later view, and an earlier one to look for it by.
struct Pair {
  Place place;
  const EarlierView* view;
};

std::vector<Pair> pairs_of(const std::vector<EarlierView>& earlier, const PinholeView& now,
                           const SeenSurface& surface) {
  std::vector<Pair> out;
  const int grid_px = std::max(1, now.width_px / kAcross);
  for (int y = grid_px; y < now.height_px; y += grid_px) {
    for (int x = grid_px; x < now.width_px; x += grid_px) {
      const auto place = place_at(now, surface, x, y);
      if (!place) continue;
      for (const EarlierView* const view : nearest_to(earlier, now, *place)) out.push_back({*place, view});
    }
  }
  return out;
}

/// How much brighter a pixel is than those about it that count, as a share: what the lamp does is left out.
cv::Mat detail_of(const PinholeView& view) {
  constexpr double kAbout_px = 6, kDark = 8, kMost = 0.25;
  cv::Mat counts, sum, number;
  view.usable.convertTo(counts, CV_32F, 1.0 / 255);
  cv::threshold(counts, counts, 0, 1, cv::THRESH_BINARY);
  cv::GaussianBlur(view.smooth.mul(counts), sum, {}, kAbout_px);
  cv::GaussianBlur(counts, number, {}, kAbout_px);
  const cv::Mat about = sum / cv::max(number, 0.05) + kDark;
  cv::Mat detail = (view.smooth + kDark) / about - 1;
  detail = cv::min(cv::max(detail, -kMost), kMost);
  return detail.mul(counts);
}

/// The patch as the later view must show it, by what the earlier one does. Empty where that shows too little of it.
std::optional<cv::Mat> expected_patch(const EarlierView& earlier, const PinholeView& now, const Place& place) {
  cv::Mat x(kSide_px, kSide_px, CV_32F), y(kSide_px, kSide_px, CV_32F);
  const double offset_mm = place.normal.dot(place.place_mm - now.eye_in_patient_mm);
  int count = 0;
  for (int row = 0; row < kSide_px; ++row) {
    for (int column = 0; column < kSide_px; ++column) {
      const Eigen::Vector3d ray = now.ray(place.at_px.x() + column - kHalf_px, place.at_px.y() + row - kHalf_px);
      const auto pixel = earlier.view.project(now.eye_in_patient_mm + ray * (offset_mm / place.normal.dot(ray)));
      x.at<float>(row, column) = static_cast<float>(pixel.x_px);
      y.at<float>(row, column) = static_cast<float>(pixel.y_px);
      if (pixel.depth_mm > 0 && shown_by(earlier.view, pixel.x_px, pixel.y_px)) ++count;
    }
  }
  if (count < kLeastUsable * kSide_px * kSide_px) return std::nullopt;
  cv::Mat patch;
  cv::remap(earlier.detail, patch, x, y, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return patch;
}

/// Correlations by shifts on a grid about none.
constexpr int kReach = 25, kShifts = 2 * kReach + 1;
struct Scores {
  cv::Mat sum = cv::Mat::zeros(kShifts, kShifts, CV_32F);
  double weight = 0, surface = 0;
  int places = 0;

  void add(const cv::Mat& correlations, double its_weight, double per_surface_mm) {
    sum += its_weight * correlations;
    weight += its_weight;
    surface += its_weight * per_surface_mm;
    ++places;
  }
};

/// Of a patch that lies about a place of the later view, by its shifts of step_mm. Empty where that leaves the picture.
std::optional<cv::Mat> correlations_of(const cv::Mat& detail, const PinholeView& now, const Place& place,
                                       const cv::Mat& patch, double step_mm) {
  const Eigen::Vector2d px_of_step(step_mm * now.fx_px / place.depth_mm, step_mm * now.fy_px / place.depth_mm);
  const cv::Size reach(static_cast<int>(std::ceil(kReach * px_of_step.x())) + 1,
                       static_cast<int>(std::ceil(kReach * px_of_step.y())) + 1);
  const cv::Rect search(static_cast<int>(place.at_px.x()) - reach.width - kHalf_px,
                        static_cast<int>(place.at_px.y()) - reach.height - kHalf_px, 2 * reach.width + kSide_px,
                        2 * reach.height + kSide_px);
  const cv::Rect all({}, detail.size());
  cv::Mat about;
  const cv::Rect inside = search & all;
  if (inside.empty()) return std::nullopt;
  cv::copyMakeBorder(detail(inside), about, inside.y - search.y, search.br().y - inside.br().y, inside.x - search.x,
                     search.br().x - inside.br().x, cv::BORDER_CONSTANT, 0);
  cv::Mat score, out;
  cv::matchTemplate(about, patch, score, cv::TM_CCOEFF_NORMED);
  const cv::Matx23d pixel_of_shift(px_of_step.x(), 0, reach.width - kReach * px_of_step.x(), 0, px_of_step.y(),
                                   reach.height - kReach * px_of_step.y());
  cv::warpAffine(score, out, pixel_of_shift, {kShifts, kShifts}, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                 cv::BORDER_REPLICATE);
  return out;
}

/// How much of a shift, mm, it looks like where the surface lies a mm further out: along the earlier view's ray.
double shift_per_surface(const PinholeView& earlier, const PinholeView& now, const Place& place) {
  const Eigen::Vector3d ray = (place.place_mm - earlier.eye_in_patient_mm).normalized();
  const auto outer = now.project(place.place_mm + ray / ray.dot(place.normal));
  return std::hypot((outer.x_px - place.at_px.x()) / now.fx_px, (outer.y_px - place.at_px.y()) / now.fy_px) *
         place.depth_mm;
}

TextureShift shift_of(const Scores& scores, int part, double step_mm) {
  constexpr double kLeastCorrelation = 0.2, kLeastLead = 0.08, kApart_mm = 2;
  constexpr double kLeadOfOne = 0.8;  // chance leads by less, the more places there are
  constexpr int kLeastPlaces = 12;    // fewer, and now and then any shift looks likely
  TextureShift out;
  out.part = part;
  out.places = scores.places;
  out.per_surface_mm = scores.surface / scores.weight;
  const cv::Mat mean = scores.sum / scores.weight;
  cv::Point at;
  cv::minMaxLoc(mean, nullptr, &out.correlation, nullptr, &at);
  out.runner_up = -1;
  for (int row = 0; row < kShifts; ++row) {
    for (int column = 0; column < kShifts; ++column) {
      if (std::hypot(row - at.y, column - at.x) * step_mm < kApart_mm) continue;
      out.runner_up = std::max(out.runner_up, static_cast<double>(mean.at<float>(row, column)));
    }
  }
  if (out.places < kLeastPlaces) return out;
  const double least_lead = std::max(kLeastLead, kLeadOfOne / std::sqrt(static_cast<double>(out.places)));
  if (at.x == 0 || at.y == 0 || at.x == kShifts - 1 || at.y == kShifts - 1) return out;
  if (out.correlation < kLeastCorrelation || out.correlation - out.runner_up < least_lead) return out;
  const auto value = [&](int column, int row) { return mean.at<float>(at.y + row, at.x + column); };
  out.shift_mm = step_mm * Eigen::Vector2d(at.x - kReach + peak_between(value(-1, 0), value(0, 0), value(1, 0)),
                                           at.y - kReach + peak_between(value(0, -1), value(0, 0), value(0, 1)));
  return out;
}

}  // namespace

EarlierView earlier_view(PinholeView view, const SeenSurface& surface) {
  constexpr int kStep_px = 4;
  DepthMap depths = depth_map(surface, view, kStep_px);
  cv::Mat detail = detail_of(view);
  return {std::move(view), std::move(depths), std::move(detail)};
}

std::vector<TextureShift> texture_shifts(const std::vector<EarlierView>& earlier, const PinholeView& now,
                                         const SeenSurface& surface, double most_mm) {
  const double step_mm = most_mm / kReach;
  const cv::Mat detail = detail_of(now);
  std::array<Scores, kPictureParts> scores;
  const std::vector<Pair> pairs = pairs_of(earlier, now, surface);
  // No more than can be looked for in a moment, from all over the picture.
  const std::size_t every = (pairs.size() + kMostPairs - 1) / kMostPairs;
  for (std::size_t n = 0; n < pairs.size(); n += every) {
    const auto& [place, view] = pairs[n];
    const auto patch = expected_patch(*view, now, place);
    if (!patch) continue;
    const auto correlations = correlations_of(detail, now, place, *patch, step_mm);
    if (!correlations) continue;
    cv::Scalar mean, deviation;
    cv::meanStdDev(*patch, mean, deviation);
    const double per_surface_mm = shift_per_surface(view->view, now, place);
    const int part = part_of(place.at_px.x(), place.at_px.y(), now.width_px, now.height_px);
    for (const int p : {part, kWholePicture})
      scores[static_cast<std::size_t>(p)].add(*correlations, deviation[0] + 1e-6, per_surface_mm);
  }
  std::vector<TextureShift> out;
  for (int part = 0; part < kPictureParts; ++part) {
    const Scores& of_part = scores[static_cast<std::size_t>(part)];
    if (of_part.places > 0) out.push_back(shift_of(of_part, part, step_mm));
  }
  return out;
}

}  // namespace birdseye::host
