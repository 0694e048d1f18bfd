#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "calibration/detect/dot_lattice.hpp"

#include "calibration/base/median.hpp"

namespace birdseye::calibration {

namespace {

constexpr std::array<int, 3> kWindows = {10, 24, 4};  // of the threshold: the picture's shorter side over these
constexpr std::size_t kLeastDots = 9;                 // the smallest grid there is
constexpr double kLarger = 1.2;                       // times the usual diameter; a measured one is some hundredths off
constexpr double kCovered = 0.88;                     // times the usual diameter of its kind: part of the dot is hidden
constexpr int kAround = 3;                            // steps; what is near a dot is what it is larger than
constexpr int kMargin = 2;                // one dot misjudged must not decide between two ways to number a grid
constexpr int kStrayRows = 2;             // beside the grid: what stands in line with its dots by chance
constexpr double kMostStrays = 0.02;      // of the dots
constexpr double kMostDotsCovered = 0.1;  // of a plain grid's dots
constexpr double kMostMisjudged = 0.34;   // of the larger dots that agree: one of three

constexpr const char* kNoGrid = "no dot grid is found";

/// A dot in rows and columns, before it is numbered.
struct Dot {
  Eigen::Vector2i place;  ///< by the lattice's own count
  std::optional<bool> larger;
  Eigen::Vector2d centre_px;
};

/// A way to number the dots: place -> turn place + shift, in the pattern's steps.
struct Numbering {
  Eigen::Matrix2i turn = Eigen::Matrix2i::Identity();
  int quarters = 0;
  Eigen::Vector2i shift = Eigen::Vector2i::Zero();
  int strays = 0;     ///< dots where the pattern has none
  int misjudged = 0;  ///< large where they should be small, or the reverse
  int larger = 0;     ///< large as they should be
  [[nodiscard]] int wrong() const { return strays + misjudged; }
};

/// The dot at a place of the pattern, in steps of spacing_mm; -1 where there is none.
int id_at(const Pattern& pattern, const Eigen::Vector2i& place) {
  const int per_column = pattern.asymmetric ? 2 : 1;
  const int x = pattern.asymmetric ? place.x() - (place.y() & 1) : place.x();
  if (place.y() < 0 || place.y() >= pattern.rows || x < 0 || x % per_column != 0) return -1;
  const int column = x / per_column, id = place.y() * pattern.columns + column;
  if (column >= pattern.columns || std::ranges::binary_search(pattern.under_bars, id)) return -1;
  return id;
}

/// From the lattice's count to the pattern's steps, by quarter turns. The nearest neighbours in an asymmetric grid
/// stand on the diagonals.
Eigen::Matrix2i turn_of(const Pattern& pattern, int quarters) {
  Eigen::Matrix2i quarter, turn;
  quarter << 0, -1, 1, 0;
  turn.setIdentity();
  if (pattern.asymmetric) turn << 1, 1, -1, 1;
  for (int k = 0; k < quarters; ++k) turn = quarter * turn;
  return turn;
}

void judge(const Pattern& pattern, const std::vector<bool>& larger_by_id, const std::vector<Dot>& dots, int give_up,
           Numbering& numbering) {
  for (const Dot& dot : dots) {
    const int id = id_at(pattern, numbering.turn * dot.place + numbering.shift);
    if (id < 0) {
      ++numbering.strays;
    } else if (dot.larger && *dot.larger != larger_by_id[static_cast<std::size_t>(id)]) {
      ++numbering.misjudged;
    } else if (dot.larger && *dot.larger) {
      ++numbering.larger;
    }
    if (numbering.wrong() > give_up) return;
  }
}

/// Every numbering that is as good as the best but for kMargin, the best first.
std::vector<Numbering> numberings(const Pattern& pattern, const std::vector<Dot>& dots) {
  std::vector<bool> larger_by_id(static_cast<std::size_t>(pattern.columns * pattern.rows), false);
  for (const int id : pattern.larger_dots) larger_by_id[static_cast<std::size_t>(id)] = true;
  const Eigen::Vector2i last((pattern.asymmetric ? 2 : 1) * pattern.columns - 1, pattern.rows - 1);
  std::vector<Numbering> all;
  int least_wrong = static_cast<int>(dots.size());
  for (int quarters = 0; quarters < 4; ++quarters) {
    Numbering numbering;
    numbering.quarters = quarters;
    numbering.turn = turn_of(pattern, quarters);
    Eigen::Vector2i low = numbering.turn * dots[0].place;
    Eigen::Vector2i high = low;
    for (const Dot& dot : dots) {
      low = low.cwiseMin(numbering.turn * dot.place);
      high = high.cwiseMax(numbering.turn * dot.place);
    }
    const Eigen::Vector2i from = (-low).cwiseMin(last - high).array() - kStrayRows;
    const Eigen::Vector2i to = (-low).cwiseMax(last - high).array() + kStrayRows;
    for (int y = from.y(); y <= to.y(); ++y) {
      for (int x = from.x(); x <= to.x(); ++x) {
        Numbering here = numbering;
        here.shift = {x, y};
        judge(pattern, larger_by_id, dots, least_wrong + kMargin - 1, here);
        if (here.wrong() >= least_wrong + kMargin) continue;
        least_wrong = std::min(least_wrong, here.wrong());
        all.push_back(here);
      }
    }
  }
  std::erase_if(all, [&](const Numbering& n) { return n.wrong() >= least_wrong + kMargin; });
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.wrong() < b.wrong(); });
  return all;
}

/// Whether the numberings differ by no more than turns that leave the pattern as it is.
bool same_but_for_turns(const Pattern& pattern, const std::vector<Numbering>& all) {
  std::array<int, 4> by_turn{};
  for (const Numbering& numbering : all) {
    const bool half = std::abs(numbering.quarters - all[0].quarters) == 2;
    const bool same = numbering.quarters == all[0].quarters;
    if (!same && !pattern.quarter_turn_ambiguous && !(half && pattern.half_turn_ambiguous)) return false;
    if (++by_turn[static_cast<std::size_t>(numbering.quarters)] > 1) return false;
  }
  return true;
}

std::string why_not_numbered(const Pattern& pattern, const std::vector<Dot>& dots, const std::vector<Numbering>& all) {
  const auto seen = static_cast<int>(dots.size());
  const int of_pattern = pattern.columns * pattern.rows - static_cast<int>(pattern.under_bars.size());
  if (pattern.larger_dots.empty()) {
    if (all[0].strays > kMostStrays * seen + kStrayRows) {
      return fmt::format("{} dots in rows and columns do not fit a grid of {}x{}: is it another pattern?", seen,
                         pattern.columns, pattern.rows);
    }
    const bool barred = !pattern.under_bars.empty();
    if (barred && !same_but_for_turns(pattern, all)) {
      return fmt::format("part of the grid, {} of {} dots, and too little of its bars to number it",
                         seen - all[0].strays, of_pattern);
    }
    const bool whole = seen - all[0].strays >= (1 - kMostDotsCovered) * of_pattern;
    if (!barred && (!whole || !same_but_for_turns(pattern, all))) {
      return fmt::format("part of the grid, {} of {} dots, and no larger dots to number it: it must be seen whole",
                         seen - all[0].strays, of_pattern);
    }
    return {};
  }
  const auto larger = std::count_if(dots.begin(), dots.end(), [](const Dot& d) { return d.larger.value_or(false); });
  if (all[0].strays > kMostStrays * seen + kStrayRows ||
      (larger >= Pattern::kLeastLargerDots && all[0].misjudged > kMostMisjudged * all[0].larger)) {
    return "the larger dots do not stand where the pattern has them: is it another pattern?";
  }
  if (!same_but_for_turns(pattern, all) || all[0].larger < Pattern::kLeastLargerDots) {
    return fmt::format("part of the grid, and too few larger dots to number it: {} dots, {} of them larger", seen,
                       larger);
  }
  return {};
}

std::vector<GridPoint> numbered(const Pattern& pattern, const std::vector<Dot>& dots, const Numbering& numbering) {
  std::vector<GridPoint> points;
  for (const Dot& dot : dots) {
    const Eigen::Vector2i place = numbering.turn * dot.place + numbering.shift;
    const int id = id_at(pattern, place);
    if (id >= 0) points.push_back({id, place, dot.centre_px});
  }
  std::sort(points.begin(), points.end(), [](const GridPoint& a, const GridPoint& b) { return a.id < b.id; });
  return points;
}

/// The median diameter of the dots around one, itself among them, in steps.
double usual_diameter(const std::vector<GridPoint>& lattice, const std::vector<DotLook>& looks, std::size_t at) {
  std::vector<double> around;
  for (std::size_t k = 0; k < lattice.size(); ++k) {
    const int apart = (lattice[k].place - lattice[at].place).cwiseAbs().maxCoeff();
    if (apart <= kAround && looks[k].diameter_steps > 0) around.push_back(looks[k].diameter_steps);
  }
  return median_of(around);
}

/// Each dot against those around it, without those that are covered in part or are no dots of this grid: blur and tilt
/// make all of them look wider or narrower than they are.
std::vector<Dot> dots_of(const Pattern& pattern, const std::vector<GridPoint>& lattice,
                         const std::vector<DotBlob>& blobs) {
  const auto looks = look_at_dots(lattice, blobs);
  std::vector<double> times_usual(lattice.size(), 0);  // 0: not known
  std::vector<double> of_larger;
  for (std::size_t i = 0; i < lattice.size(); ++i) {
    if (looks[i].diameter_steps <= 0) continue;
    times_usual[i] = looks[i].diameter_steps / usual_diameter(lattice, looks, i);
    if (times_usual[i] > kLarger) of_larger.push_back(times_usual[i]);
  }
  const double usual_larger = of_larger.empty() ? 0 : median_of(of_larger);
  std::vector<Dot> dots;
  for (std::size_t i = 0; i < lattice.size(); ++i) {
    Dot dot{lattice[i].place, std::nullopt, looks[i].centre_px};
    if (times_usual[i] > 0) {
      const bool larger = times_usual[i] > kLarger;
      if (times_usual[i] < kCovered || (larger && pattern.larger_dots.empty())) continue;
      if (larger && times_usual[i] < kCovered * usual_larger) continue;
      if (!pattern.larger_dots.empty()) dot.larger = larger;
    }
    dots.push_back(dot);
  }
  return dots;
}

/// The share of the dark places that are saturated: dots that were not found where the grid has them.
double glare_of(const Pattern& pattern, const GreyView& picture, const std::vector<GridPoint>& points) {
  std::vector<bool> seen(static_cast<std::size_t>(pattern.columns * pattern.rows), false);
  for (const GridPoint& point : points) seen[static_cast<std::size_t>(point.id)] = true;
  double saturated = 0;
  for (int y = 0; y < pattern.rows; ++y) {
    for (int x = 0; x < (pattern.asymmetric ? 2 : 1) * pattern.columns; ++x) {
      const int id = id_at(pattern, {x, y});
      if (id < 0 || seen[static_cast<std::size_t>(id)]) continue;
      const auto map = fit_local_map(points, {x, y}, 2, true);
      if (map && inside(picture, map->a, 1) && grey_at(picture, map->a) >= kSaturated) ++saturated;
    }
  }
  return saturated / std::max(1.0, saturated + static_cast<double>(points.size()));
}

/// A lattice has many pairs of steps. The two shortest are the rows' and the columns' up to a tilt of some 50 degrees;
/// beyond, one of them is a diagonal.
std::array<Eigen::Matrix2i, 5> step_choices() {
  std::array<Eigen::Matrix2i, 5> choices;
  choices[0] << 1, 0, 0, 1;
  choices[1] << 1, 1, 0, 1;
  choices[2] << 1, -1, 0, 1;
  choices[3] << 1, 0, 1, 1;
  choices[4] << 1, 0, -1, 1;
  return choices;
}

/// The dots' numbers, or why they cannot be told.
struct NumberedDots {
  std::vector<GridPoint> points;
  std::string failure;
};

NumberedDots number_dots(const Pattern& pattern, const std::vector<Dot>& dots) {
  const auto ways = numberings(pattern, dots);
  NumberedDots best{{}, why_not_numbered(pattern, dots, ways)};
  double most_upright = -2;
  for (const Numbering& way : ways) {
    if (way.wrong() > ways[0].wrong()) break;
    auto points = numbered(pattern, dots, way);
    const double upright = uprightness(points);
    if (upright <= most_upright) continue;
    most_upright = upright;
    best.points = std::move(points);
    if (!best.failure.empty()) break;
  }
  return best;
}

/// Where the dots' places, mirrored, can be numbered.
bool is_mirrored(const Pattern& pattern, std::vector<GridPoint> lattice, const std::vector<DotBlob>& blobs) {
  if (pattern.larger_dots.empty() && !pattern.asymmetric) return false;
  for (GridPoint& point : lattice) point.place.x() *= -1;
  auto dots = dots_of(pattern, lattice, blobs);
  return why_not_numbered(pattern, dots, numberings(pattern, dots)).empty();
}

NumberedDots number_lattice(const Pattern& pattern, const std::vector<GridPoint>& lattice,
                            const std::vector<DotBlob>& blobs) {
  std::optional<NumberedDots> first;
  for (const Eigen::Matrix2i& choice : step_choices()) {
    auto points = lattice;
    for (GridPoint& point : points) point.place = choice * point.place;
    auto result = number_dots(pattern, dots_of(pattern, points, blobs));
    if (result.failure.empty()) return result;
    if (!first) first = std::move(result);
    if (is_mirrored(pattern, points, blobs)) {
      first->failure =
          "the picture is mirrored, or the board is seen from behind: turn the mirroring off where it is made";
      break;
    }
  }
  return *first;
}

FoundPattern find_with(const Pattern& pattern, const GreyView& picture, bool dark, int window_px) {
  FoundPattern found;
  const auto blobs = find_dot_blobs(picture, dark, window_px);
  const auto lattice =
      grow_dot_lattice(blobs, static_cast<std::size_t>(pattern.columns) * static_cast<std::size_t>(pattern.rows));
  if (lattice.size() < kLeastDots) {
    found.failure = kNoGrid;
    return found;
  }
  std::vector<double> contrasts;
  for (const GridPoint& point : lattice) {
    const DotBlob& blob = blobs[static_cast<std::size_t>(point.id)];
    contrasts.push_back(blob.contrast);
    const auto edges = dot_edges(picture, blob);
    found.edges.insert(found.edges.end(), edges.begin(), edges.end());
  }
  found.contrast = median_of(contrasts);
  const NumberedDots dots = number_lattice(pattern, lattice, blobs);
  found.failure = dots.failure;
  if (dark) found.glare = glare_of(pattern, picture, dots.points);
  for (const GridPoint& point : dots.points) {
    found.ids.push_back(point.id);
    found.points_px.push_back(point.px);
  }
  return found;
}

}  // namespace

FoundPattern find_dots(const Pattern& pattern, const GreyView& picture) {
  FoundPattern best;
  best.failure = kNoGrid;
  const auto all = static_cast<std::size_t>(pattern.columns) * static_cast<std::size_t>(pattern.rows);
  for (const bool dark : {true, false}) {
    for (const int window : kWindows) {
      auto found = find_with(pattern, picture, dark, std::min(picture.width_px, picture.height_px) / window);
      const auto rank = [](const FoundPattern& f) { return std::pair(f.failure.empty(), f.ids.size()); };
      if (rank(found) > rank(best)) best = std::move(found);
      if (best.failure.empty() && best.ids.size() == all) return best;
    }
    if (best.failure.empty()) return best;
  }
  return best;
}

}  // namespace birdseye::calibration
