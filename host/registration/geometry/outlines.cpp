#include "host/registration/geometry/outlines.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace birdseye::host {

namespace {

constexpr int kBand_px = 22;  ///< across which the outline is looked for, to each side

/// Log of how much likelier each pixel's colour is in the organ than about it, whatever its brightness: shading makes
/// the organ's rim as dark as anything. Zero where it is too dark to tell.
cv::Mat log_ratio(const PinholeView& view, const cv::Mat& organ, const cv::Mat& about) {
  constexpr int kBins = 32;
  constexpr float kDark = 8, kRare = 1e-3F, kMost = 3;
  cv::Mat smooth, chroma(view.height_px, view.width_px, CV_32FC2);
  cv::GaussianBlur(view.colour, smooth, {}, 0.8);
  cv::Mat light(view.height_px, view.width_px, CV_8U);
  for (int y = 0; y < view.height_px; ++y) {
    for (int x = 0; x < view.width_px; ++x) {
      const cv::Vec3b c = smooth.at<cv::Vec3b>(y, x);
      const float sum = static_cast<float>(c[0] + c[1] + c[2]);
      chroma.at<cv::Vec2f>(y, x) = {(static_cast<float>(c[0]) + kDark / 3) / (sum + kDark),
                                    (static_cast<float>(c[1]) + kDark / 3) / (sum + kDark)};
      light.at<std::uint8_t>(y, x) = sum > 3 * kDark ? 255 : 0;
    }
  }
  const int bins[] = {kBins, kBins};
  const float red[] = {0.25F, 0.75F}, green[] = {0.1F, 0.5F};
  const float* ranges[] = {red, green};
  const int channels[] = {0, 1};
  cv::Mat of_organ, of_about;
  cv::calcHist(&chroma, 1, channels, organ & light, of_organ, 2, bins, ranges);
  cv::calcHist(&chroma, 1, channels, about & light, of_about, 2, bins, ranges);
  for (cv::Mat* h : {&of_organ, &of_about}) {
    cv::GaussianBlur(*h, *h, {}, 0.8);
    *h /= std::max(1.0, cv::sum(*h)[0]);
  }
  cv::Mat out = cv::Mat::zeros(view.height_px, view.width_px, CV_32F);
  for (int y = 0; y < view.height_px; ++y) {
    for (int x = 0; x < view.width_px; ++x) {
      if (light.at<std::uint8_t>(y, x) == 0) continue;
      const cv::Vec2f c = chroma.at<cv::Vec2f>(y, x);
      const int r = std::clamp(static_cast<int>((c[0] - red[0]) / (red[1] - red[0]) * kBins), 0, kBins - 1);
      const int g = std::clamp(static_cast<int>((c[1] - green[0]) / (green[1] - green[0]) * kBins), 0, kBins - 1);
      out.at<float>(y, x) =
          std::clamp(std::log((of_organ.at<float>(r, g) + kRare) / (of_about.at<float>(r, g) + kRare)), -kMost, kMost);
    }
  }
  return out;
}

cv::Mat disc(int radius_px) {
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius_px + 1, 2 * radius_px + 1});
}

/// Where the surface is in a view's picture now: 255 there.
cv::Mat silhouette(const PinholeView& view, const DepthMap& depths) {
  cv::Mat coarse(depths.rows, depths.columns, CV_8U), wide;
  std::transform(depths.depth_mm.begin(), depths.depth_mm.end(), coarse.begin<std::uint8_t>(),
                 [](float depth) { return static_cast<std::uint8_t>(std::isfinite(depth) ? 255 : 0); });
  // Sample c of the map is of pixel c * step_px.
  const double step = depths.step_px;
  const cv::Matx23d coarse_from_wide(1 / step, 0, 0, 0, 1 / step, 0);
  cv::warpAffine(coarse, wide, coarse_from_wide, {view.width_px, view.height_px},
                 cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  return wide > 127;
}

/// Across a contour: from kBand_px inside the silhouette to as much outside.
struct Line {
  Eigen::Vector2d middle_px, outwards;
  [[nodiscard]] Eigen::Vector2d at(double offset_px) const { return middle_px + offset_px * outwards; }
};

std::optional<Line> line_across(const cv::Mat& mask, const std::vector<cv::Point>& contour, std::size_t i) {
  constexpr std::size_t kReach = 8;
  constexpr double kStraight_px = 4, kBeside_px = 5;
  const auto at = [&](std::size_t n) {
    const cv::Point& p = contour[n % contour.size()];
    return Eigen::Vector2d(p.x, p.y);
  };
  const Eigen::Vector2d along = at(i + kReach) - at(i + contour.size() - kReach);
  if (along.norm() < kStraight_px) return std::nullopt;
  Line line{at(i), Eigen::Vector2d(along.y(), -along.x()).normalized()};
  const auto inside = [&](double offset_px) {
    const Eigen::Vector2d p = line.at(offset_px);
    const cv::Point pixel(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
    return cv::Rect({}, mask.size()).contains(pixel) && mask.at<std::uint8_t>(pixel) != 0;
  };
  if (inside(kBeside_px) == inside(-kBeside_px)) return std::nullopt;
  if (inside(kBeside_px)) line.outwards = -line.outwards;
  return line;
}

double bilinear(const cv::Mat& values, const Eigen::Vector2d& at) {
  const int x = static_cast<int>(at.x()), y = static_cast<int>(at.y());
  const double s = at.x() - x, t = at.y() - y;
  const float* const upper = values.ptr<float>(y) + x;
  const float* const lower = values.ptr<float>(y + 1) + x;
  return (1 - t) * ((1 - s) * static_cast<double>(upper[0]) + s * static_cast<double>(upper[1])) +
         t * ((1 - s) * static_cast<double>(lower[0]) + s * static_cast<double>(lower[1]));
}

/// Where along a line the organ's colours end: so that all before it speaks for the organ and all after it against, to
/// a part of a pixel. Empty where either side says too little, the line ends first, or it leaves where the lens is
/// trusted.
std::optional<double> edge_of(const Line& line, const cv::Mat& ratio, const cv::Mat& trusted) {
  constexpr double kLeastGain = 6;
  constexpr int kFromEnd_px = 4;
  double sum = 0, least = 0, best = -std::numeric_limits<double>::max(), least_before_best = 0;
  int best_at = -kBand_px;
  for (int offset = -kBand_px; offset <= kBand_px; ++offset) {
    const Eigen::Vector2d p = line.at(offset);
    const cv::Point pixel(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
    if (!cv::Rect(1, 1, ratio.cols - 2, ratio.rows - 2).contains(pixel) || trusted.at<std::uint8_t>(pixel) == 0)
      return std::nullopt;
    sum += bilinear(ratio, p);
    least = std::min(least, sum);
    if (sum <= best) continue;
    best = sum;
    best_at = offset;
    least_before_best = least;
  }
  if (std::abs(best_at) > kBand_px - kFromEnd_px) return std::nullopt;
  if (best - least_before_best < kLeastGain || best - sum < kLeastGain) return std::nullopt;
  const double before = bilinear(ratio, line.at(best_at)), after = bilinear(ratio, line.at(best_at + 1));
  if (!(before > 0 && after <= 0)) return std::nullopt;
  return best_at + before / (before - after);
}

/// Along a ray, the first place where the distance to the surface is least.
struct Closest {
  double depth_mm, distance_mm;
};
Closest closest_place(const SeenSurface& surface, const PinholeView& view, const Eigen::Vector3d& ray,
                      double from_depth_mm) {
  constexpr double kBefore_mm = 15, kBehind_mm = 60, kStep_mm = 0.5;
  Closest out{from_depth_mm, std::numeric_limits<double>::max()};
  double last_mm = out.distance_mm;
  const auto steps = static_cast<int>((kBefore_mm + kBehind_mm) * ray.norm() / kStep_mm);
  for (int step = 0; step <= steps; ++step) {
    const double depth = from_depth_mm - kBefore_mm + step * kStep_mm / ray.norm();
    const double distance_mm = surface.distance().distance_mm(view.eye_in_patient_mm + depth * ray);
    if (distance_mm < out.distance_mm) out = {depth, distance_mm};
    if (out.distance_mm < 0 && distance_mm > 0 && distance_mm > last_mm) break;  // out of the organ again
    last_mm = distance_mm;
  }
  return out;
}

std::vector<SeenPoint> of_view(const PinholeView& view, const SeenSurface& surface, double most_mm) {
  constexpr int kDepthStep_px = 4, kLeastPixels = 2000;
  constexpr std::size_t kEvery_px = 6, kLeastLength_px = 120;
  constexpr double kSigma_mm = 0.3;
  const cv::Mat mask = silhouette(view, depth_map(surface, view, kDepthStep_px));
  cv::Mat inner, outer, trusted;
  cv::erode(mask, inner, disc(kBand_px));
  cv::dilate(mask, outer, disc(kBand_px));
  const cv::Mat organ = inner & view.usable, about = ~outer & view.usable;
  if (cv::countNonZero(organ) < kLeastPixels || cv::countNonZero(about) < kLeastPixels) return {};
  const cv::Mat ratio = log_ratio(view, organ, about);
  cv::erode(view.lens, trusted, disc(kBand_px), {-1, -1}, 1, cv::BORDER_CONSTANT, 0);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(mask, contours, cv::RETR_LIST, cv::CHAIN_APPROX_NONE);
  std::vector<SeenPoint> out;
  for (const auto& contour : contours) {
    if (contour.size() < kLeastLength_px) continue;
    for (std::size_t i = 0; i < contour.size(); i += kEvery_px) {
      const auto line = line_across(mask, contour, i);
      if (!line) continue;
      const auto edge = edge_of(*line, ratio, trusted);
      if (!edge) continue;
      const Eigen::Vector2d pixel = line->at(*edge);
      const Eigen::Vector3d ray = view.ray(pixel.x(), pixel.y());
      const auto met = surface.meet(view.eye_in_patient_mm, ray);
      if (!met) continue;
      const Closest closest = closest_place(surface, view, ray, met->depth_mm);
      if (std::abs(closest.distance_mm) > most_mm) continue;
      out.push_back({view.eye_in_patient_mm + closest.depth_mm * ray, kSigma_mm, std::nullopt});
      out.back().by_lens_mm = by_lens_errors(out.back().place_mm, std::array{&view});
    }
  }
  return out;
}

}  // namespace

std::vector<SeenPoint> outline_points(const std::vector<PinholeView>& views, const SeenSurface& surface,
                                      double most_mm) {
  std::vector<std::vector<SeenPoint>> each(views.size());
  tbb::parallel_for(std::size_t{0}, views.size(),
                    [&](std::size_t n) { each[n] = of_view(views[n], surface, most_mm); });
  std::vector<SeenPoint> out;
  for (const auto& points : each) out.insert(out.end(), points.begin(), points.end());
  return out;
}

}  // namespace birdseye::host
