#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::calibration {

enum class PatternKind { chessboard, charuco, dots };

/// A flat calibration pattern and the numbers of its points. Lengths in mm; frame Marker: x along the columns, y along
/// the rows, both as one reads the pattern from its front (x right, y down), z = 0 on it and positive behind it.
struct Pattern {
  static constexpr int kLeastLargerDots = 3;  ///< two leave the side from which a grid is seen open
  static constexpr int kLeastUnderBars = 4;   ///< so many dots stand where bars should, if a grid is numbered wrongly

  PatternKind kind = PatternKind::chessboard;
  std::string spec;           ///< what it was read from, for messages
  int columns = 0, rows = 0;  ///< chessboard: inner corners; charuco: squares; dots: dots
  double spacing_mm = 0;      ///< side of a square; from dot to dot (asymmetric: from row to row)
  double tag_mm = 0;          ///< charuco: side of a tag
  int dictionary = 0;         ///< charuco: OpenCV's number of the dictionary of tags
  bool legacy = false;        ///< charuco: laid out as OpenCV before 4.6 did
  int inset_columns = 0;      ///< charuco: inner corners of a chessboard set into its middle; 0: there is none
  int inset_rows = 0;
  double inset_mm = 0;           ///< side of one of its squares
  bool asymmetric = false;       ///< dots: every second row moved by half the distance along a row
  std::vector<int> under_bars;   ///< dots: ids of places that bars cover, ascending; no dot is there
  std::vector<int> larger_dots;  ///< dots: ids of those that are larger, ascending; empty where all are alike
  /// Turned by half a turn the pattern looks the same: which end is the first is then a guess, made afresh in each
  /// view. No matter to the lens; hand-eye must allow for it.
  bool half_turn_ambiguous = false;
  /// The same for a quarter of a turn.
  bool quarter_turn_ambiguous = false;
};

/// `chessboard:14x10:3mm` (inner corners), `charuco:19x26:5mm:4mm:DICT_4X4_250[:legacy]` (squares, side of a square and
/// of a tag), with `:inset=8x13:3mm` behind it where a chessboard of so many inner corners lies in its middle,
/// `dots:11x9:4mm`, `dots:4x11:5mm:asymmetric`, `dots:25x18:3mm:markers=133,141,308,317` (larger dots by id, row by row
/// from 0), `dots:19x15:2mm:bars=142-146,105-181` (bars in place of dots, from id to id). Lengths in mm, cm or m.
Result<Pattern> parse_pattern(const std::string& spec);

/// In the frame Marker, by id: corners or dots row by row, the first at the origin; of a ChArUco board the inner
/// corners, the outer corner of the board at the origin, then those of its inset.
std::vector<Eigen::Vector3d> pattern_points_mm(const Pattern& pattern);

/// A tag of a ChArUco board: the square that it lies in, counted from 0. The vector's index is the tag's number.
struct TagPlace {
  int column = 0, row = 0;
};
std::vector<TagPlace> tag_places(const Pattern& pattern);

}  // namespace birdseye::calibration
