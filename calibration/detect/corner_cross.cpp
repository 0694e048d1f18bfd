#include "calibration/detect/corner_cross.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "calibration/base/median.hpp"
#include "calibration/picture/picture_mat.hpp"

namespace birdseye::calibration {

namespace {

constexpr double kCrossSmoothing_px = 0.8;  // enough against noise and the pixels' steps
constexpr int kMostRounds = 25;
constexpr double kSettled_px = 0.002;
constexpr double kLeastGrey = 6;         // a difference below this is noise
constexpr double kWeakestOfMedian = .3;  // of twelve places along the edges ..
constexpr int kLeastPlaces = 11;         // .. so many show this share of the usual difference

/// Gradients times their lines: the sums of refine_cross.
struct Lines {
  Eigen::Matrix2d matrix = Eigen::Matrix2d::Zero();
  Eigen::Vector2d offset = Eigen::Vector2d::Zero();
};

Lines sum_lines(const GreyView& smooth, const Eigen::Vector2d& centre, const Eigen::Matrix2d& squares_per_px,
                const CrossReach& reach, const Eigen::Vector2i& half) {
  Lines lines;
  const int left = std::max(1, static_cast<int>(std::floor(centre.x())) - half.x());
  const int right = std::min(smooth.width_px - 2, static_cast<int>(std::ceil(centre.x())) + half.x());
  const int top = std::max(1, static_cast<int>(std::floor(centre.y())) - half.y());
  const int bottom = std::min(smooth.height_px - 2, static_cast<int>(std::ceil(centre.y())) + half.y());
  for (int y = top; y <= bottom; ++y) {
    const std::uint8_t* row = smooth.row(y);
    for (int x = left; x <= right; ++x) {
      const Eigen::Vector2d d = Eigen::Vector2d(x, y) - centre;
      const Eigen::Vector2d place = (squares_per_px * d).cwiseAbs();
      const double along = place.maxCoeff() / reach.along;
      const double aside = place.minCoeff() / reach.aside;
      if (along >= 1 || aside >= 1) continue;
      const Eigen::Vector2d gradient(row[x + 1] - row[x - 1], row[x + smooth.width_px] - row[x - smooth.width_px]);
      // Tapered, so that a pixel that enters or leaves as the centre moves counts for nothing.
      const double weight = (1 - along * along) * (1 - aside * aside);
      const Eigen::Matrix2d part = weight * gradient * gradient.transpose();
      lines.matrix += part;
      lines.offset += part * d;
    }
  }
  return lines;
}

/// Mean grey across an edge, from -half to half in steps, along the arm from `near` to `far` squares.
std::vector<double> profile_across(const GreyView& picture, const Eigen::Vector2d& centre, const Eigen::Vector2d& arm,
                                   const Eigen::Vector2d& normal, double near, double far, double half, double step) {
  constexpr int kLines = 6;
  std::vector<double> profile;
  const int steps = static_cast<int>(std::floor(2 * half / step + 1e-9));
  for (int i = 0; i <= steps; ++i) {
    const double t = -half + i * step;
    double sum = 0;
    for (int k = 0; k < kLines; ++k)
      sum += grey_at(picture, centre + arm * (near + (far - near) * k / (kLines - 1)) + normal * t);
    profile.push_back(sum / kLines);
  }
  return profile;
}

/// Rise over steepest slope, px; 0 where there is no edge.
double width_of(const std::vector<double>& profile, double step_px) {
  const auto [low, high] = std::minmax_element(profile.begin(), profile.end());
  double steepest = 0;
  for (std::size_t i = 2; i < profile.size(); ++i)
    steepest = std::max(steepest, std::abs(profile[i] - profile[i - 2]) / (2 * step_px));
  return steepest > 0 && *high - *low > kLeastGrey ? (*high - *low) / steepest : 0;
}

}  // namespace

SmoothPicture::SmoothPicture(const GreyView& picture)
    : width_px_(picture.width_px),
      height_px_(picture.height_px),
      grey_(static_cast<std::size_t>(picture.width_px) * static_cast<std::size_t>(picture.height_px)) {
  cv::Mat to(height_px_, width_px_, CV_8UC1, grey_.data());
  cv::GaussianBlur(mat_of(picture), to, cv::Size(0, 0), kCrossSmoothing_px);
}

GreyView SmoothPicture::view() const {
  return {grey_, width_px_, height_px_};
}

std::optional<Eigen::Vector2d> refine_cross(const GreyView& smooth, const Cross& cross, const CrossReach& reach) {
  if (std::abs(cross.px_per_square.determinant()) < 1) return std::nullopt;
  const Eigen::Matrix2d squares_per_px = cross.px_per_square.inverse();
  const Eigen::Vector2i half =
      (reach.along * cross.px_per_square.cwiseAbs().rowwise().sum()).array().ceil().cast<int>();
  const double side_px = std::sqrt(std::abs(cross.px_per_square.determinant()));
  Eigen::Vector2d centre = cross.centre_px;
  for (int round = 0; round < kMostRounds; ++round) {
    const Lines lines = sum_lines(smooth, centre, squares_per_px, reach, half);
    const double trace = lines.matrix.trace();
    if (!(lines.matrix.determinant() > 1e-4 * trace * trace)) return std::nullopt;  // edges one way only
    const Eigen::Vector2d step = lines.matrix.inverse() * lines.offset;
    centre += step;
    if ((centre - cross.centre_px).norm() > 0.25 * side_px || !inside(smooth, centre, 2)) return std::nullopt;
    if (step.norm() < kSettled_px) break;
  }
  return centre;
}

CrossLook look_at_cross(const GreyView& picture, const Cross& cross, const CrossReach& reach) {
  CrossLook look;
  constexpr std::array<double, 3> kAlong = {0.45, 0.7, 0.95};
  std::vector<double> differences;
  for (int arm = 0; arm < 4; ++arm) {
    const int axis = arm / 2;
    const double sign = arm % 2 == 0 ? 1 : -1;
    const Eigen::Vector2d along = sign * cross.px_per_square.col(axis);
    const Eigen::Vector2d across = cross.px_per_square.col(1 - axis);
    const Eigen::Vector2d normal(Eigen::Vector2d(-along.y(), along.x()).normalized() *
                                 ((along.x() * across.y() - along.y() * across.x()) > 0 ? 1 : -1));
    const double square_px = std::abs(normal.dot(across));
    // On the arm towards +x the side of +y is the square ahead; on each next one colours swap.
    const double light_side = cross.dark_ahead == (sign > 0) ? -1 : 1;
    const double aside_px = std::max(0.5 * reach.aside * square_px, 1.2);
    for (const double part : kAlong) {
      const Eigen::Vector2d at = cross.centre_px + part * reach.along * along;
      if (!inside(picture, at, aside_px)) return look;
      differences.push_back(light_side *
                            (grey_at(picture, at + aside_px * normal) - grey_at(picture, at - aside_px * normal)));
    }
    constexpr double kStep_px = 0.5;
    const double width = width_of(profile_across(picture, cross.centre_px, along, normal, 0.5 * reach.along,
                                                 reach.along, std::max(reach.aside * square_px, 2.0), kStep_px),
                                  kStep_px);
    if (width > 0) look.edges.push_back({normal, width});
  }
  look.contrast = median_of(differences);
  const double least = std::max(kLeastGrey, kWeakestOfMedian * look.contrast);
  look.is_cross =
      std::count_if(differences.begin(), differences.end(), [&](double d) { return d > least; }) >= kLeastPlaces;
  return look;
}

}  // namespace birdseye::calibration
