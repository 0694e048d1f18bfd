#include "calibration/detect/dot_blobs.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "calibration/picture/picture_mat.hpp"

namespace birdseye::calibration {

namespace {

constexpr double kLeastDotContrast = 8;   // grey levels from the window's mean to the threshold, twice
constexpr double kLeastArea_px2 = 12;     // below, a spot is too few pixels for a centroid to a tenth of one
constexpr double kMostOfPicture = 0.02;   // no dot of a grid is larger
constexpr double kMostElongated = 4;      // long over short axis; a tilt of 75 degrees
constexpr double kEllipseArea = 0.15;     // by how much a spot's area may differ from its moments' ellipse, as a share
constexpr double kRimError_px = 0.1;      // .. and by a rim this wide besides: pixels cut it to steps
constexpr double kRimFrom_px = 1.5;       // the ground is read outside the dot from here ..
constexpr double kRimTo_px = 3.5;         // .. to here
constexpr std::size_t kLeastGround = 12;  // pixels; a plane is fitted to them

/// One connected component as the threshold cut it.
struct Spot {
  int label = 0;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  double area = 0;
};

Spot moments_of(const cv::Mat& labels, const cv::Rect& box, int label) {
  Spot spot;
  spot.label = label;
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (int y = box.y; y < box.y + box.height; ++y) {
    const int* row = labels.ptr<int>(y);
    for (int x = box.x; x < box.x + box.width; ++x) {
      if (row[x] != label) continue;
      const Eigen::Vector2d d(x - box.x, y - box.y);
      spot.area += 1;
      spot.centre += d;
      second += d * d.transpose();
    }
  }
  spot.centre /= spot.area;
  // A pixel is a square of side 1, not a point: it spreads by 1/12 itself.
  spot.spread =
      second / spot.area - spot.centre * spot.centre.transpose() + Eigen::Matrix2d(Eigen::Matrix2d::Identity() / 12);
  spot.centre += Eigen::Vector2d(box.x, box.y);
  return spot;
}

bool is_elliptic(const Spot& spot) {
  const double determinant = spot.spread.determinant();
  const double half_trace = spot.spread.trace() / 2;
  const double root = std::sqrt(std::max(0.0, half_trace * half_trace - determinant));
  if (half_trace + root > kMostElongated * kMostElongated * (half_trace - root)) return false;
  const double ellipse = 4 * std::numbers::pi * std::sqrt(determinant);
  const double rim = std::sqrt(4 * std::numbers::pi * ellipse);
  return std::abs(spot.area - ellipse) < kEllipseArea * ellipse + kRimError_px * rim;
}

/// Squared distance from the middle, 1 on the ellipse with these moments; and the shape that gives it.
struct Ellipse {
  Eigen::Vector2d centre;
  Eigen::Matrix2d inverse;
  Eigen::Vector2d half;  ///< of the box around it

  Ellipse(const Eigen::Vector2d& at, const Eigen::Matrix2d& spread, double wider_px) : centre(at) {
    const double short_px = 2 * std::sqrt(std::sqrt(spread.determinant()));
    const double scale = (short_px + wider_px) / short_px;
    const Eigen::Matrix2d shape = 4 * scale * scale * spread;
    inverse = shape.inverse();
    half = shape.diagonal().cwiseSqrt();
  }
  [[nodiscard]] bool holds(const Eigen::Vector2d& px) const { return (px - centre).dot(inverse * (px - centre)) <= 1; }
};

/// The ground around a spot: grey = plane . (1, dx, dy).
std::optional<Eigen::Vector3d> ground_of(const GreyView& picture, const cv::Mat& labels, const Spot& spot) {
  const Ellipse inner(spot.centre, spot.spread, kRimFrom_px);
  const Ellipse outer(spot.centre, spot.spread, kRimTo_px);
  Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const Eigen::Vector2i from = (spot.centre - outer.half).array().floor().cast<int>();
  const Eigen::Vector2i to = (spot.centre + outer.half).array().ceil().cast<int>();
  for (int y = std::max(0, from.y()); y <= std::min(picture.height_px - 1, to.y()); ++y) {
    for (int x = std::max(0, from.x()); x <= std::min(picture.width_px - 1, to.x()); ++x) {
      const Eigen::Vector2d px(x, y);
      if (labels.at<int>(y, x) != 0 || inner.holds(px) || !outer.holds(px)) continue;
      const Eigen::Vector3d row(1, px.x() - spot.centre.x(), px.y() - spot.centre.y());
      normal_matrix += row * row.transpose();
      right += row * picture.row(y)[x];
    }
  }
  if (normal_matrix(0, 0) < kLeastGround) return std::nullopt;
  const Eigen::FullPivLU<Eigen::Matrix3d> solver(normal_matrix);
  if (!solver.isInvertible()) return std::nullopt;
  return solver.solve(right);
}

/// The dot by its greys: every pixel counts by how far it is from the ground, in units of the dot's middle.
std::optional<DotBlob> weigh(const GreyView& picture, const cv::Mat& labels, const Spot& spot, bool dark) {
  const auto ground = ground_of(picture, labels, spot);
  if (!ground) return std::nullopt;
  const double sign = dark ? 1 : -1;
  const Ellipse reach(spot.centre, spot.spread, kRimFrom_px);
  const Eigen::Vector2i from = (spot.centre - reach.half).array().floor().cast<int>();
  const Eigen::Vector2i to = (spot.centre + reach.half).array().ceil().cast<int>();
  if (from.minCoeff() < 0 || to.x() >= picture.width_px || to.y() >= picture.height_px) return std::nullopt;
  double sum = 0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  std::vector<double> depths;
  for (int y = from.y(); y <= to.y(); ++y) {
    for (int x = from.x(); x <= to.x(); ++x) {
      const Eigen::Vector2d d = Eigen::Vector2d(x, y) - spot.centre;
      if (!reach.holds(spot.centre + d)) continue;
      const int label = labels.at<int>(y, x);
      if (label != 0 && label != spot.label) continue;
      const double depth = sign * (ground->dot(Eigen::Vector3d(1, d.x(), d.y())) - picture.row(y)[x]);
      sum += depth;
      first += depth * d;
      if (label == spot.label) depths.push_back(depth);
    }
  }
  // The middle of the dot: the upper quarter of the depths, for the rim is not yet all dark.
  const auto upper = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() * 3 / 4);
  std::nth_element(depths.begin(), upper, depths.end());
  if (*upper < kLeastDotContrast || sum <= 0) return std::nullopt;
  const DotBlob blob{spot.centre + first / sum, spot.spread, sum / *upper, *upper};
  if ((blob.centroid_px - spot.centre).norm() > 1) return std::nullopt;  // what is near pulls at it
  return blob;
}

}  // namespace

std::vector<DotBlob> find_dot_blobs(const GreyView& picture, bool dark, int window_px) {
  cv::Mat smooth;
  cv::GaussianBlur(mat_of(picture), smooth, cv::Size(0, 0), 0.8);
  cv::Mat mask;
  cv::adaptiveThreshold(smooth, mask, 255, cv::ADAPTIVE_THRESH_MEAN_C, dark ? cv::THRESH_BINARY_INV : cv::THRESH_BINARY,
                        window_px | 1, dark ? kLeastDotContrast / 2 : -kLeastDotContrast / 2);
  cv::Mat labels, boxes, centres;
  const int count = cv::connectedComponentsWithStats(mask, labels, boxes, centres, 4, CV_32S);
  const double most = kMostOfPicture * picture.width_px * picture.height_px;
  std::vector<DotBlob> blobs;
  for (int label = 1; label < count; ++label) {
    const cv::Rect box(boxes.at<int>(label, cv::CC_STAT_LEFT), boxes.at<int>(label, cv::CC_STAT_TOP),
                       boxes.at<int>(label, cv::CC_STAT_WIDTH), boxes.at<int>(label, cv::CC_STAT_HEIGHT));
    const int area = boxes.at<int>(label, cv::CC_STAT_AREA);
    if (area < kLeastArea_px2 || area > most || box.x < 1 || box.y < 1 || box.br().x >= picture.width_px ||
        box.br().y >= picture.height_px) {
      continue;
    }
    const Spot spot = moments_of(labels, box, label);
    if (!is_elliptic(spot)) continue;
    if (const auto blob = weigh(picture, labels, spot, dark)) blobs.push_back(*blob);
  }
  return blobs;
}

std::vector<EdgeWidth> dot_edges(const GreyView& picture, const DotBlob& blob) {
  constexpr int kPlaces = 8;
  constexpr double kStep_px = 0.5;
  const Eigen::Matrix2d root = (4 * blob.spread_px2).llt().matrixL();
  const Eigen::Matrix2d normals = root.inverse().transpose();
  std::vector<EdgeWidth> edges;
  for (int k = 0; k < kPlaces; ++k) {
    const double angle_rad = 2 * std::numbers::pi * k / kPlaces;
    const Eigen::Vector2d on_unit(std::cos(angle_rad), std::sin(angle_rad));
    const Eigen::Vector2d from_centre = root * on_unit;
    const Eigen::Vector2d normal = (normals * on_unit).normalized();
    const double inward_px = normal.dot(from_centre);
    double steepest = 0, low = 255, high = 0, before = 0, last = 0;
    const double outward_px = std::max(kRimTo_px, inward_px);  // a soft edge is as wide outside as inside
    const int steps = static_cast<int>((inward_px + outward_px) / kStep_px);
    for (int step = 0; step <= steps; ++step) {
      const double at = step * kStep_px - inward_px;
      const double grey = grey_at(picture, blob.centroid_px + from_centre + at * normal);
      low = std::min(low, grey);
      high = std::max(high, grey);
      if (step >= 2) steepest = std::max(steepest, std::abs(grey - before) / (2 * kStep_px));
      before = last;
      last = grey;
    }
    if (steepest > 0 && high - low > kLeastDotContrast) edges.push_back({normal, (high - low) / steepest});
  }
  return edges;
}

}  // namespace birdseye::calibration
