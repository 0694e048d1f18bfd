#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "calibration/base/image_view.hpp"
#include "calibration/detect/pattern.hpp"
#include "calibration/detect/pattern_view.hpp"

namespace birdseye::calibration {

/// What a picture of a ChArUco board tells of the layout of its tags, which OpenCV changed in 4.6. Of the corners
/// between two tags: how many the tags put at one place, less those that they put a square and more apart, in the
/// layout that was told and in the other one. With an odd count of columns the two layouts differ at the ends of the
/// rows alone: where no end is seen, both figures are alike.
struct LayoutEvidence {
  int joined = 0, joined_in_other = 0;
  /// A misread tag joins or tears a corner or two.
  [[nodiscard]] bool is_other() const { return joined_in_other >= joined + 3; }
};

/// Corners of a ChArUco board's inset, of one picture or of several.
struct InsetEvidence {
  std::size_t looked_for = 0, found = 0;
  /// It is not where the pattern has it: other counts, another square, another board.
  [[nodiscard]] bool is_wrong() const { return looked_for >= 12 && found == 0; }
};

/// What a picture shows of a pattern, and how well it shows it. Figures are given where they could be taken, for
/// rejected pictures too.
struct Detection {
  std::optional<PatternView> view;
  std::string rejected;  ///< why there is no view, in words; empty where there is one

  int points_seen = 0, points_of_pattern = 0;
  double sharpness_px = 0;  ///< how wide the pattern's edges are, median; 0: none measured
  /// The line along which the picture moved, degrees from the picture's x towards its y, -90 to 90. Only where edges
  /// are much wider one way than the other.
  std::optional<double> motion_deg;
  double glare = 0;       ///< share of the pattern's dark places that are saturated
  double contrast = 0;    ///< light less dark of the pattern, grey levels
  double area_share = 0;  ///< of the picture, within the outline of the points
  LayoutEvidence layout;  ///< of a ChArUco board
  InsetEvidence inset;    ///< of one with an inset
};

/// How much time a picture without the pattern may take. `thorough` searches again and looks for the reason why nothing
/// was found, which may take seconds; `quick` gives up within a second, as a guided procedure needs.
enum class Search { thorough, quick };

/// The pattern in a grey picture, points to some hundredths of a pixel. A chessboard and a plain dot grid must be seen
/// whole; of a ChArUco board, and of a grid with larger dots, a part is enough.
/// Which point is the first: a chessboard with one odd and one even count begins at the corner of the board whose
/// square is dark. Where turns of the pattern look alike (Pattern::half_turn_ambiguous), the numbering is taken whose
/// columns run to the picture's right.
Detection detect(const Pattern& pattern, const GreyView& picture, const std::string& name,
                 Search search = Search::thorough);

}  // namespace birdseye::calibration
