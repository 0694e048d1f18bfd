#include "host/registration/similarity/overlap_mask.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <random>

#include "calibration/picture/picture_mat.hpp"

namespace birdseye::host {

namespace {

using Points = std::vector<Eigen::Vector2d>;

/// Of each pixel, the least and the greatest of its channels.
std::pair<cv::Mat, cv::Mat> channel_range(const cv::Mat& rgb) {
  std::vector<cv::Mat> channels;
  cv::split(rgb, channels);
  const cv::Mat least = cv::min(cv::min(channels[0], channels[1]), channels[2]);
  const cv::Mat greatest = cv::max(cv::max(channels[0], channels[1]), channels[2]);
  return {least, greatest};
}

/// What counts as lit: clearly brighter than the dark corners. Nothing where no corner is dark.
std::optional<int> lit_from(const cv::Mat& brightness) {
  constexpr int kDarkest = 40, kAbove = 10;
  const int size = std::max(4, std::min(brightness.cols, brightness.rows) / 40);
  std::optional<int> level;
  for (const int x : {0, brightness.cols - size}) {
    for (const int y : {0, brightness.rows - size}) {
      const auto mean = static_cast<int>(cv::mean(brightness(cv::Rect(x, y, size, size)))[0]);
      if (mean < kDarkest) level = std::max(level.value_or(0), mean + kAbove);
    }
  }
  return level;
}

/// The largest connected part of a mask: without a logo beside the field, or reflections in the lens.
cv::Mat largest_part(const cv::Mat& mask) {
  cv::Mat labels, stats, centroids;
  const int count = cv::connectedComponentsWithStats(mask, labels, stats, centroids);
  int largest = 0;
  for (int label = 1; label < count; ++label) {
    if (largest == 0 || stats.at<int>(label, cv::CC_STAT_AREA) > stats.at<int>(largest, cv::CC_STAT_AREA))
      largest = label;
  }
  return labels == std::max(largest, 1);
}

/// The outermost lit pixels of rows and columns, unless it is the picture that ends there.
Points rim_of(const cv::Mat& lit) {
  const int margin_x = lit.cols / 50, margin_y = lit.rows / 50;
  Points rim;
  const auto keep = [&](int x, int y) {
    if (x >= margin_x && x < lit.cols - margin_x && y >= margin_y && y < lit.rows - margin_y) rim.emplace_back(x, y);
  };
  for (int y = 0; y < lit.rows; ++y) {
    const std::uint8_t* const row = lit.ptr(y);
    const std::uint8_t* const end = row + lit.cols;
    const std::uint8_t* const first = std::find_if(row, end, [](std::uint8_t v) { return v != 0; });
    if (first == end) continue;
    keep(static_cast<int>(first - row), y);
    int last = lit.cols - 1;
    while (row[last] == 0) --last;
    keep(last, y);
  }
  for (int x = 0; x < lit.cols; ++x) {
    int first = 0, last = lit.rows - 1;
    while (first <= last && lit.at<std::uint8_t>(first, x) == 0) ++first;
    if (first > last) continue;
    while (lit.at<std::uint8_t>(last, x) == 0) --last;
    keep(x, first);
    keep(x, last);
  }
  return rim;
}

/// Least squares of x^2 + a y^2 + b x + c y + d = 0 over at least four points about the picture's middle. Nothing where
/// that is no ellipse such as a lens field in this picture may be.
std::optional<LensField> fit(const Points& points, const cv::Size& picture) {
  if (points.size() < 4) return std::nullopt;
  const double scale = 0.5 * std::hypot(picture.width, picture.height);
  const Eigen::Vector2d middle(0.5 * picture.width, 0.5 * picture.height);
  Eigen::Matrix<double, Eigen::Dynamic, 4> left(points.size(), 4);
  Eigen::VectorXd right(points.size());
  for (Eigen::Index i = 0; i < left.rows(); ++i) {
    const Eigen::Vector2d p = (points[static_cast<std::size_t>(i)] - middle) / scale;
    left.row(i) << p.y() * p.y(), p.x(), p.y(), 1;
    right[i] = -p.x() * p.x();
  }
  const Eigen::Vector4d k = left.colPivHouseholderQr().solve(right);
  constexpr double kLeastAspect = 0.8, kMostAspect = 1.25, kLeastRadius = 0.4, kMostRadius = 1.5, kOffCentre = 0.25;
  if (!(k[0] > 0)) return std::nullopt;
  const double aspect = 1 / std::sqrt(k[0]);  // radius along y per radius along x
  const Eigen::Vector2d centre = scale * Eigen::Vector2d(-0.5 * k[1], -0.5 * k[2] / k[0]) + middle;
  const double square = 0.25 * k[1] * k[1] + 0.25 * k[2] * k[2] / k[0] - k[3];
  if (!(square > 0)) return std::nullopt;
  const double radius = std::sqrt(square) * scale;
  const Eigen::Vector2d off = (centre - middle).cwiseAbs();
  const bool plausible = aspect >= kLeastAspect && aspect <= kMostAspect && off.x() <= kOffCentre * picture.width &&
                         off.y() <= kOffCentre * picture.height && radius <= kMostRadius * scale &&
                         radius >= kLeastRadius * std::min(picture.width, picture.height);
  if (!plausible) return std::nullopt;
  return LensField{centre.x(), centre.y(), radius, aspect * radius};
}

/// Distance beyond the edge, px; negative inside.
double beyond(const LensField& field, const Eigen::Vector2d& p) {
  const double r =
      std::hypot((p.x() - field.centre_x_px) / field.radius_x_px, (p.y() - field.centre_y_px) / field.radius_y_px);
  return (r - 1) * 0.5 * (field.radius_x_px + field.radius_y_px);
}

cv::Mat filled(const LensField& field, const cv::Size& picture, double margin_px) {
  const auto single = [](double v) { return static_cast<float>(v); };
  cv::Mat mask = cv::Mat::zeros(picture, CV_8U);
  cv::ellipse(
      mask,
      cv::RotatedRect({single(field.centre_x_px), single(field.centre_y_px)},
                      {single(2 * (field.radius_x_px - margin_px)), single(2 * (field.radius_y_px - margin_px))}, 0),
      cv::Scalar(255), cv::FILLED);
  return mask;
}

/// The ellipse with most of the rim on it and next to none outside (RANSAC: tissue in shadow makes rim too, inside the
/// true one; a reflection in the lens outside), then least squares over what lies on it.
std::optional<LensField> fit_robustly(const Points& rim, const cv::Size& picture) {
  constexpr int kTrials = 2000;
  constexpr double kOnIt = 0.3, kOutside = 0.05;
  const double tolerance_px = std::max(1.5, 0.004 * std::hypot(picture.width, picture.height));
  std::mt19937 random(1);
  std::uniform_int_distribution<std::size_t> any(0, rim.size() - 1);
  std::optional<LensField> best;
  std::ptrdiff_t most = static_cast<std::ptrdiff_t>(kOnIt * static_cast<double>(rim.size()));
  const auto on_it = [&](const LensField& field) {
    Points on;
    std::ptrdiff_t outside = 0;
    for (const Eigen::Vector2d& p : rim) {
      const double d = beyond(field, p);
      if (std::abs(d) <= tolerance_px) on.push_back(p);
      if (d > tolerance_px) ++outside;
    }
    if (static_cast<double>(outside) > kOutside * static_cast<double>(rim.size())) on.clear();
    return on;
  };
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto field = fit({rim[any(random)], rim[any(random)], rim[any(random)], rim[any(random)]}, picture);
    if (!field) continue;
    const auto count = std::ssize(on_it(*field));
    if (count > most) {
      most = count;
      best = field;
    }
  }
  if (!best) return std::nullopt;
  const auto refined = fit(on_it(*best), picture);
  return refined && std::ssize(on_it(*refined)) >= most ? refined : best;
}

Error wrong_size(const char* name, std::size_t size, const RgbView& video) {
  return {Errc::bad_value, fmt::format("{}: {} values, not those of {}x{} pixels; give one of the video's size", name,
                                       size, video.width_px, video.height_px)};
}

}  // namespace

std::optional<LensField> find_lens_field(const RgbView& video) {
  constexpr int kSmallest = 16, kWidth = 480;
  if (std::min(video.width_px, video.height_px) < kSmallest) return std::nullopt;
  // Coarse pixels are enough for an edge that is blurred, and have less noise.
  const double scale = std::min(1.0, kWidth / static_cast<double>(video.width_px));
  cv::Mat brightness;
  cv::resize(channel_range(mat_of(video)).second, brightness, {}, scale, scale, cv::INTER_AREA);
  cv::medianBlur(brightness, brightness, 5);
  const auto level = lit_from(brightness);
  if (!level) return std::nullopt;
  const cv::Mat lit = largest_part(brightness > *level);
  const Points rim = rim_of(lit);
  constexpr std::size_t kShortest = 20;
  if (rim.size() < kShortest) return std::nullopt;
  const auto field = fit_robustly(rim, brightness.size());
  if (!field) return std::nullopt;
  // To the centres of the picture's own pixels.
  const double x = video.width_px / static_cast<double>(brightness.cols),
               y = video.height_px / static_cast<double>(brightness.rows);
  return LensField{(field->centre_x_px + 0.5) * x - 0.5, (field->centre_y_px + 0.5) * y - 0.5, field->radius_x_px * x,
                   field->radius_y_px * y};
}

Result<std::vector<std::uint8_t>> overlap_mask(const RgbView& video, std::span<const std::uint8_t> instruments) {
  if (!video.whole() || video.area_px() == 0) return wrong_size("video picture", video.pixels.size(), video);
  if (!instruments.empty() && instruments.size() != video.area_px()) {
    return wrong_size("instrument mask", instruments.size(), video);
  }
  const cv::Size size(video.width_px, video.height_px);
  cv::Mat mask(size, CV_8U, cv::Scalar(255));
  if (const auto field = find_lens_field(video)) {
    // The edge is blurred: some of it is left out.
    mask = filled(*field, size, std::max(3.0, 0.015 * field->radius_x_px));
  }
  // Highlights: nearly white. A bright colour, such as fat close to the light, is tissue and stays.
  constexpr double kBright = 240, kLeastOfGreatest = 0.75;
  const auto [least, greatest] = channel_range(mat_of(video));
  cv::Mat scaled;
  greatest.convertTo(scaled, CV_8U, kLeastOfGreatest);
  cv::Mat highlights;
  cv::bitwise_and(greatest >= kBright, least >= scaled, highlights);
  const int grow_px = std::max(2, video.width_px / 256);
  cv::dilate(highlights, highlights, cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * grow_px + 1, 2 * grow_px + 1}));
  mask.setTo(0, highlights);
  if (!instruments.empty()) mask.setTo(0, mat_of(GreyView{instruments, video.width_px, video.height_px}) != 0);
  if (cv::countNonZero(mask) == 0) {
    return Error{Errc::degenerate,
                 "overlap: nothing is left of the video picture but surround, highlights and "
                 "instruments; take another view"};
  }
  return std::vector<std::uint8_t>(mask.datastart, mask.dataend);
}

}  // namespace birdseye::host
