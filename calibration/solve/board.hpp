#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::calibration {

/// A chessboard, by its inner corners.
struct BoardSpec {
  int columns = 0, rows = 0;
  double square_mm = 0;
};

/// `chessboard:14x10:3mm`.
Result<BoardSpec> parse_board(const std::string& spec);
/// The corners in the frame Marker, row by row: x along the columns, y along the rows, z = 0.
std::vector<Eigen::Vector3d> board_points_mm(const BoardSpec& board);

/// A grey picture somewhere in memory.
struct GreyView {
  const std::uint8_t* data = nullptr;
  int width_px = 0, height_px = 0;
  std::size_t stride = 0;  ///< bytes from row to row
};

/// A board as one picture shows it: the pixel of each corner, in the order of board_points_mm.
struct BoardView {
  std::vector<Eigen::Vector2d> corners_px;
};

/// The board in the picture, to a fraction of a pixel; empty where not all of it is seen. Which of its two ends is the
/// first follows from the colours where the board tells them apart (one odd and one even count of corners): the first
/// corner is the one whose square, on the board's side, is dark.
std::optional<BoardView> find_board(const BoardSpec& board, const GreyView& picture);

}  // namespace birdseye::calibration
