#include "calibration/detect/grid_points.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "calibration/base/median.hpp"
#include "calibration/geometry/linear_algebra.hpp"

namespace birdseye::calibration {

namespace {

constexpr std::size_t kLeastForPlane = 5;       // one more than an affine map needs, twice over
constexpr std::size_t kLeastForCurvature = 10;  // six unknowns each way

}  // namespace

double grey_at(const GreyView& picture, const Eigen::Vector2d& px) {
  const double x = std::clamp(px.x(), 0.0, picture.width_px - 1.001);
  const double y = std::clamp(px.y(), 0.0, picture.height_px - 1.001);
  const int column = static_cast<int>(x);
  const int row = static_cast<int>(y);
  const double fx = x - column;
  const double fy = y - row;
  const std::uint8_t* top = picture.row(row) + column;
  const std::uint8_t* bottom = top + picture.width_px;
  return (1 - fy) * ((1 - fx) * top[0] + fx * top[1]) + fy * ((1 - fx) * bottom[0] + fx * bottom[1]);
}

bool inside(const GreyView& picture, const Eigen::Vector2d& px, double margin_px) {
  return px.x() >= margin_px && px.y() >= margin_px && px.x() <= picture.width_px - 1 - margin_px &&
         px.y() <= picture.height_px - 1 - margin_px;
}

std::optional<LocalMap> fit_local_map(const std::vector<GridPoint>& points, const Eigen::Vector2i& place, int reach,
                                      bool without_itself) {
  std::vector<const GridPoint*> near;
  for (const GridPoint& point : points) {
    const Eigen::Vector2i step = point.place - place;
    if (step.cwiseAbs().maxCoeff() > reach || (without_itself && step.isZero())) continue;
    near.push_back(&point);
  }
  if (near.size() < kLeastForPlane) return std::nullopt;
  const bool curved = near.size() >= kLeastForCurvature;
  const auto count = static_cast<Eigen::Index>(near.size());
  Eigen::MatrixXd design(count, curved ? 6 : 3);
  Eigen::MatrixXd pixels(count, 2);
  for (Eigen::Index i = 0; i < count; ++i) {
    const GridPoint& point = *near[static_cast<std::size_t>(i)];
    const Eigen::Vector2d d = (point.place - place).cast<double>();
    design(i, 0) = 1;
    design(i, 1) = d.x();
    design(i, 2) = d.y();
    if (curved) design.row(i).tail<3>() << d.x() * d.x() / 2, d.x() * d.y(), d.y() * d.y() / 2;
    pixels.row(i) = point.px;
  }
  const LeastSquares fit = solve_least_squares(design, pixels);
  if (fit.rank < design.cols()) return std::nullopt;
  const Eigen::MatrixXd& solved = fit.x;
  LocalMap map;
  map.a = solved.row(0);
  map.jacobian.col(0) = solved.row(1);
  map.jacobian.col(1) = solved.row(2);
  map.hxx = map.hxy = map.hyy = Eigen::Vector2d::Zero();
  if (curved) {
    map.hxx = solved.row(3);
    map.hxy = solved.row(4);
    map.hyy = solved.row(5);
  }
  return map;
}

void drop_strays(std::vector<GridPoint>& points, const std::function<double(double)>& allowed_px) {
  constexpr int kReach = 2;
  constexpr int kWiderReach = 3;
  std::vector<double> excess(points.size());
  const auto judge = [&](std::size_t i) {
    auto map = fit_local_map(points, points[i].place, kReach, true);
    // At a corner of the board eight neighbours fix a plane only, and a tilted board seen through a wide lens is none.
    if (!map || map->hxx.isZero()) {
      if (const auto wider = fit_local_map(points, points[i].place, kWiderReach, true)) map = wider;
    }
    if (!map) return 0.0;  // nothing to hold it against
    const double step_px = std::sqrt(std::abs(map->jacobian.determinant()));
    return (points[i].px - map->a).norm() / allowed_px(step_px);
  };
  for (std::size_t i = 0; i < points.size(); ++i) excess[i] = judge(i);
  while (!points.empty()) {
    const auto worst = std::max_element(excess.begin(), excess.end());
    if (*worst <= 1) return;
    const Eigen::Vector2i gone = points[static_cast<std::size_t>(worst - excess.begin())].place;
    points.erase(points.begin() + (worst - excess.begin()));
    excess.erase(worst);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if ((points[i].place - gone).cwiseAbs().maxCoeff() <= kWiderReach) excess[i] = judge(i);
    }
  }
}

double uprightness(const std::vector<GridPoint>& points) {
  // Slope of the pixels over the columns, rows held: the normal equations of an affine fit.
  Eigen::Vector2d mean_place = Eigen::Vector2d::Zero();
  Eigen::Vector2d mean_px = Eigen::Vector2d::Zero();
  for (const GridPoint& point : points) {
    mean_place += point.place.cast<double>() / static_cast<double>(points.size());
    mean_px += point.px / static_cast<double>(points.size());
  }
  Eigen::Matrix2d by_place = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d by_px = Eigen::Matrix2d::Zero();
  for (const GridPoint& point : points) {
    const Eigen::Vector2d d = point.place.cast<double>() - mean_place;
    by_place += d * d.transpose();
    by_px += (point.px - mean_px) * d.transpose();
  }
  const Eigen::Matrix2d jacobian = by_place.transpose().fullPivHouseholderQr().solve(by_px.transpose()).transpose();
  return jacobian.col(0).norm() > 0 ? jacobian(0, 0) / jacobian.col(0).norm() : 0;
}

}  // namespace birdseye::calibration
