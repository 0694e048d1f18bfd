#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "calibration/base/median.hpp"
#include "calibration/detect/corner_cross.hpp"
#include "calibration/detect/picture_edges.hpp"
#include "calibration/picture/picture_mat.hpp"

namespace birdseye::calibration {

namespace {

constexpr CrossReach kCornerReach{0.42, 0.25};
constexpr double kThorough_px = 640;  // the width to which a picture is reduced for a search that takes seconds ..
constexpr double kWords_px = 480;     // .. and for one of which only words come
constexpr double kMostCornersCovered = 0.1;  // of the corners; more, and what covers them may have moved others

/// Of a row's first corner.
std::size_t index_of(int row, int columns) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns);
}

/// One of the ways in which a found grid can be counted.
std::vector<GridPoint> counted(const std::vector<cv::Point2f>& corners, int columns, int rows, int quarters) {
  std::vector<GridPoint> points;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      Eigen::Vector2i place(column, row);
      if (quarters % 2 == 1) place = {row, columns - 1 - column};  // a square board only
      if (quarters >= 2) place = {columns - 1 - place.x(), rows - 1 - place.y()};
      const cv::Point2f& px = corners[index_of(row, columns) + static_cast<std::size_t>(column)];
      points.push_back({place.y() * columns + place.x(), place, {px.x, px.y}});
    }
  }
  std::sort(points.begin(), points.end(), [](const GridPoint& a, const GridPoint& b) { return a.id < b.id; });
  return points;
}

/// Whether the square whose first corner is the first one is dark.
bool first_is_dark(const GreyView& picture, const std::vector<GridPoint>& points, int columns) {
  const auto middle = [&](int column) {
    const auto first = static_cast<std::size_t>(column);
    const auto below = index_of(1, columns) + static_cast<std::size_t>(column);
    return Eigen::Vector2d(0.25 * (points[first].px + points[first + 1].px + points[below].px + points[below + 1].px));
  };
  return grey_at(picture, middle(0)) < grey_at(picture, middle(1));
}

/// The counting that Detection promises: dark first where a turn swaps the colours, then upright.
std::vector<GridPoint> oriented(const GreyView& smooth, std::vector<cv::Point2f> corners, int columns, int rows) {
  const auto at = [&](int i) { return corners[static_cast<std::size_t>(i)]; };
  const cv::Point2f along = at(columns - 1) - at(0);
  const cv::Point2f down = at(columns * (rows - 1)) - at(0);
  if (along.cross(down) < 0) {  // counted from behind
    for (int row = 0; row < rows; ++row) {
      const auto first = corners.begin() + static_cast<std::ptrdiff_t>(index_of(row, columns));
      std::reverse(first, first + columns);
    }
  }
  std::vector<GridPoint> best;
  std::pair<bool, double> best_rank{false, -2};
  for (int quarters = 0; quarters < 4; ++quarters) {
    if (quarters % 2 == 1 && columns != rows) continue;
    std::vector<GridPoint> points = counted(corners, columns, rows, quarters);
    const std::pair<bool, double> rank{first_is_dark(smooth, points, columns), uprightness(points)};
    if (rank <= best_rank) continue;
    best_rank = rank;
    best = std::move(points);
  }
  return best;
}

cv::Mat reduced(const cv::Mat& grey, double width_px) {
  const double scale = std::min(1.0, width_px / grey.cols);
  cv::Mat small;
  cv::resize(grey, small, cv::Size(), scale, scale, cv::INTER_AREA);
  return small;
}

bool find_thoroughly(const cv::Mat& grey, const cv::Size& size, std::vector<cv::Point2f>& corners) {
  const cv::Mat small = reduced(grey, kThorough_px);
  if (!cv::findChessboardCornersSB(small, size, corners, cv::CALIB_CB_NORMALIZE_IMAGE)) return false;
  const float scale = static_cast<float>(grey.cols) / static_cast<float>(small.cols);
  const cv::Point2f half(0.5F, 0.5F);  // a pixel's middle lies at whole numbers
  for (cv::Point2f& corner : corners) corner = (corner + half) * scale - half;
  return true;
}

/// A board of counts near those that were told, in words; empty where none is seen.
std::string counted_otherwise(const Pattern& pattern, const cv::Mat& grey) {
  constexpr std::array<std::array<int, 2>, 7> kMore{{{-1, -1}, {-1, 0}, {0, -1}, {1, 1}, {1, 0}, {0, 1}, {-2, -2}}};
  for (const auto& [columns_more, rows_more] : kMore) {
    const cv::Size size(pattern.columns + columns_more, pattern.rows + rows_more);
    std::vector<cv::Point2f> corners;
    constexpr int kFast = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK;
    if (size.width < 3 || size.height < 3 || !cv::findChessboardCorners(grey, size, corners, kFast)) continue;
    const bool squares = columns_more == -1 && rows_more == -1;
    return fmt::format("a chessboard of {}x{} inner corners is seen where {}x{} are expected: {}", size.width,
                       size.height, pattern.columns, pattern.rows,
                       squares ? "squares were counted; give its inner corners in --board"
                               : "it is another board, or its border is covered; give its inner corners in "
                                 "--board");
  }
  return {};
}

/// What else of a chessboard is seen, in words.
std::string why_not(const Pattern& pattern, const cv::Mat& grey) {
  if (std::string words = counted_otherwise(pattern, grey); !words.empty()) return words;
  const cv::Mat small = reduced(grey, kWords_px);
  std::vector<cv::Point2f> corners;
  cv::Mat size;
  if (!cv::findChessboardCornersSB(small, cv::Size(3, 3), corners, cv::CALIB_CB_LARGER | cv::CALIB_CB_NORMALIZE_IMAGE,
                                   size) ||
      size.empty()) {
    return "no chessboard is found";
  }
  const cv::Rect box = cv::boundingRect(corners);
  const int step = std::max(box.width / std::max(1, size.cols - 1), box.height / std::max(1, size.rows - 1));
  const bool cut = box.x < step || box.y < step || box.br().x > small.cols - step || box.br().y > small.rows - step;
  const bool swapped = (size.cols < size.rows) != (pattern.columns < pattern.rows);
  const int columns = swapped ? size.rows : size.cols, rows = swapped ? size.cols : size.rows;
  const bool more = columns > pattern.columns || rows > pattern.rows;
  const bool squares = columns == pattern.columns - 1 && rows == pattern.rows - 1;
  return fmt::format("a chessboard of {}x{} inner corners is seen where {}x{} are expected: {}", columns, rows,
                     pattern.columns, pattern.rows,
                     more      ? "it is another board"
                     : squares ? "were squares counted, and not inner corners? Else its border is covered"
                     : cut     ? "part of it lies outside the picture"
                               : "part of it is covered, or it is another board");
}

}  // namespace

FoundPattern find_chessboard(const Pattern& pattern, const GreyView& picture, Search search) {
  const cv::Mat grey = mat_of(picture);
  FoundPattern found;
  std::vector<cv::Point2f> corners;
  const int flags = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK;
  const cv::Size size(pattern.columns, pattern.rows);
  if (!cv::findChessboardCorners(grey, size, corners, flags)) {
    // The second search is thorough and slow.
    if (search == Search::quick || is_blurred(picture)) {
      found.failure = "no chessboard is found";
      return found;
    }
    if (!find_thoroughly(grey, size, corners)) {
      found.failure = why_not(pattern, grey);
      return found;
    }
  }
  const SmoothPicture smooth(picture);
  const std::vector<GridPoint> rough = oriented(smooth.view(), corners, pattern.columns, pattern.rows);
  const bool dark = first_is_dark(smooth.view(), rough, pattern.columns);
  std::vector<double> contrasts;
  std::vector<GridPoint> points;
  for (const GridPoint& point : rough) {
    const auto map = fit_local_map(rough, point.place, 2, false);
    if (!map) continue;
    Cross cross{point.px, map->jacobian, dark == ((point.place.x() + point.place.y()) % 2 == 0)};
    const auto refined = refine_cross(smooth.view(), cross, kCornerReach);
    if (!refined) continue;
    cross.centre_px = *refined;
    const CrossLook look = look_at_cross(smooth.view(), cross, kCornerReach);
    if (!look.is_cross) continue;
    points.push_back({point.id, point.place, *refined});
    contrasts.push_back(look.contrast);
    found.edges.insert(found.edges.end(), look.edges.begin(), look.edges.end());
  }
  drop_strays(points, [](double step_px) { return std::max(1.0, 0.06 * step_px); });
  found.contrast = median_of(contrasts);
  for (const GridPoint& point : points) {
    found.ids.push_back(point.id);
    found.points_px.push_back(point.px);
  }
  const std::size_t lost = rough.size() - points.size();
  if (static_cast<double>(lost) > kMostCornersCovered * static_cast<double>(rough.size()))
    found.failure = fmt::format("{} of {} corners are covered or washed out", lost, rough.size());
  return found;
}

}  // namespace birdseye::calibration
