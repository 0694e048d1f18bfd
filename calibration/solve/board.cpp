#include "calibration/solve/board.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace birdseye::calibration {

namespace {

/// Mean grey in the middle of the square whose first corner is corner (column, row).
double square_grey(const cv::Mat& grey, const std::vector<cv::Point2f>& corners, int columns, int column, int row) {
  const auto at = [&](int c, int r) {
    return corners[static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(c)];
  };
  const cv::Point2f middle =
      0.25F * (at(column, row) + at(column + 1, row) + at(column, row + 1) + at(column + 1, row + 1));
  cv::Mat patch;
  cv::getRectSubPix(grey, cv::Size(5, 5), middle, patch);
  return cv::mean(patch)[0];
}

/// The window in which a corner is refined: as large as the nearest other corner allows.
int refinement_radius_px(const std::vector<cv::Point2f>& corners, int columns) {
  float nearest = 1e9F;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const bool last_column = (i + 1) % static_cast<std::size_t>(columns) == 0;
    if (!last_column) nearest = std::min(nearest, static_cast<float>(cv::norm(corners[i + 1] - corners[i])));
    if (i + static_cast<std::size_t>(columns) < corners.size()) {
      nearest =
          std::min(nearest, static_cast<float>(cv::norm(corners[i + static_cast<std::size_t>(columns)] - corners[i])));
    }
  }
  return std::clamp(static_cast<int>(0.35F * nearest), 2, 9);
}

}  // namespace

Result<BoardSpec> parse_board(const std::string& spec) {
  BoardSpec board;
  int end = 0;
  const int fields =
      std::sscanf(spec.c_str(), "chessboard:%dx%d:%lfmm%n", &board.columns, &board.rows, &board.square_mm, &end);
  if (fields != 3 || static_cast<std::size_t>(end) != spec.size() || board.columns < 3 || board.rows < 3 ||
      board.columns > 100 || board.rows > 100 || !(board.square_mm > 0) || board.square_mm > 1000) {
    return Error{Errc::bad_value, fmt::format("board \"{}\": give chessboard:COLUMNSxROWS:SQUAREmm, inner corners, as "
                                              "chessboard:14x10:3mm",
                                              spec)};
  }
  return board;
}

std::vector<Eigen::Vector3d> board_points_mm(const BoardSpec& board) {
  std::vector<Eigen::Vector3d> points;
  for (int row = 0; row < board.rows; ++row) {
    for (int column = 0; column < board.columns; ++column) {
      points.emplace_back(column * board.square_mm, row * board.square_mm, 0);
    }
  }
  return points;
}

std::optional<BoardView> find_board(const BoardSpec& board, const GreyView& picture) {
  const cv::Mat grey(picture.height_px, picture.width_px, CV_8UC1, const_cast<std::uint8_t*>(picture.data),
                     picture.stride);
  std::vector<cv::Point2f> corners;
  const int flags = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK;
  if (!cv::findChessboardCorners(grey, cv::Size(board.columns, board.rows), corners, flags)) return std::nullopt;
  const int radius = refinement_radius_px(corners, board.columns);
  cv::cornerSubPix(grey, corners, cv::Size(radius, radius), cv::Size(-1, -1),
                   cv::TermCriteria(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 40, 0.003));
  if ((board.columns + board.rows) % 2 == 1) {
    const double first = square_grey(grey, corners, board.columns, 0, 0);
    const double last = square_grey(grey, corners, board.columns, board.columns - 2, board.rows - 2);
    if (first > last) std::reverse(corners.begin(), corners.end());
  }
  BoardView view;
  for (const cv::Point2f& corner : corners) view.corners_px.emplace_back(corner.x, corner.y);
  return view;
}

}  // namespace birdseye::calibration
