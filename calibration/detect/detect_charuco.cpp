#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cstdlib>
#include <map>
#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>

#include "calibration/detect/corner_cross.hpp"

#include "calibration/base/median.hpp"
#include "calibration/picture/picture_mat.hpp"

namespace birdseye::calibration {

namespace {

constexpr std::size_t kLeastCorners = 12;  // fewer do not hold a pose against the lens' distortion
constexpr double kAlong_squares = 0.45;    // used of a corner's edges
constexpr double kEdgeOfTag_px = 1.6;      // how far the blur of a tag's own edge reaches
constexpr std::ptrdiff_t kNeighbours = 2;  // of a corner that no tag names
constexpr double kAgree_squares = 0.2;     // two tags that put one corner farther apart are not both read rightly

/// A corner as the tags beside it predict it.
struct Predicted {
  std::vector<Cross> by_tag;
};

/// By the corner's id.
std::map<int, Predicted> predict(const Pattern& pattern, const std::vector<int>& ids,
                                 const std::vector<std::vector<cv::Point2f>>& quads) {
  const auto places = tag_places(pattern);
  const float inset = static_cast<float>(0.5 * (1 - pattern.tag_mm / pattern.spacing_mm));
  const std::vector<cv::Point2f> tag = {{inset, inset}, {1 - inset, inset}, {1 - inset, 1 - inset}, {inset, 1 - inset}};
  std::map<int, Predicted> corners;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (ids[i] < 0 || static_cast<std::size_t>(ids[i]) >= places.size()) continue;
    const TagPlace place = places[static_cast<std::size_t>(ids[i])];
    const cv::Matx33d h = cv::getPerspectiveTransform(tag, quads[i]);
    for (int k = 0; k < 4; ++k) {
      const int dx = k % 2;
      const int dy = k / 2;
      const int column = place.column + dx - 1;
      const int row = place.row + dy - 1;
      if (column < 0 || row < 0 || column >= pattern.columns - 1 || row >= pattern.rows - 1) continue;
      const cv::Vec3d p = h * cv::Vec3d(dx, dy, 1);
      Cross cross;
      cross.centre_px = Eigen::Vector2d(p[0], p[1]) / p[2];
      for (int axis = 0; axis < 2; ++axis) {
        const Eigen::Vector2d column_of(h(0, axis), h(1, axis));
        cross.px_per_square.col(axis) = (column_of - cross.centre_px * h(2, axis)) / p[2];
      }
      cross.dark_ahead = dx != dy;  // tags lie in light squares: ahead of this corner where it is the square's first
      corners[row * (pattern.columns - 1) + column].by_tag.push_back(cross);
    }
  }
  return corners;
}

/// Of the corners between two tags, those that the tags put within reach of each other less those that they put a
/// square and more apart.
int joined_in(const std::map<int, Predicted>& corners) {
  int joined = 0;
  for (const auto& [id, predicted] : corners) {
    if (predicted.by_tag.size() != 2) continue;
    const Cross& cross = predicted.by_tag[0];
    const double apart_px = (cross.centre_px - predicted.by_tag[1].centre_px).norm();
    const double side_px = std::sqrt(std::abs(cross.px_per_square.determinant()));
    if (apart_px < kAgree_squares * side_px) ++joined;
    if (apart_px > side_px) --joined;
  }
  return joined;
}

/// What two tags that agree say of the corner between them.
std::optional<Cross> agreed(const Predicted& predicted) {
  if (predicted.by_tag.size() != 2) return std::nullopt;
  Cross cross = predicted.by_tag[0];
  const Cross& other = predicted.by_tag[1];
  const double side_px = std::sqrt(std::abs(cross.px_per_square.determinant()));
  if (!((cross.centre_px - other.centre_px).norm() < kAgree_squares * side_px)) return std::nullopt;
  if (cross.px_per_square.determinant() * other.px_per_square.determinant() <= 0) return std::nullopt;
  cross.centre_px = 0.5 * (cross.centre_px + other.centre_px);
  cross.px_per_square = 0.5 * (cross.px_per_square + other.px_per_square);
  return cross;
}

/// The board's corners as they are found.
class CornerSearch {
 public:
  CornerSearch(const Pattern& pattern, const GreyView& picture)
      : columns_(pattern.columns - 1),
        rows_(pattern.rows - 1),
        margin_(0.5 * (1 - pattern.tag_mm / pattern.spacing_mm)),
        smooth_(picture) {}

  void add(int id, Cross cross) {
    const double side_px = std::sqrt(std::abs(cross.px_per_square.determinant()));
    const CrossReach reach{kAlong_squares, std::max(0.5 * margin_, margin_ - kEdgeOfTag_px / side_px)};
    const auto refined = refine_cross(smooth_.view(), cross, reach);
    if (!refined) return;
    cross.centre_px = *refined;
    const CrossLook look = look_at_cross(smooth_.view(), cross, reach);
    if (!look.is_cross) return;
    points_.push_back({id, {id % columns_, id / columns_}, *refined});
    looks_[id] = look;
    first_dark_ahead_ = cross.dark_ahead == ((id % columns_ + id / columns_) % 2 == 0);
  }

  /// Corners beside those found, where a tag was not read: their neighbours say where they are.
  void grow() {
    for (std::size_t before = 0; before != points_.size();) {
      before = points_.size();
      const std::vector<GridPoint> known = points_;
      for (int id = 0; id < columns_ * rows_; ++id) {
        const Eigen::Vector2i place(id % columns_, id / columns_);
        if (looks_.contains(id) || !has_neighbours(known, place)) continue;
        const auto map = fit_local_map(known, place, 2, false);
        if (!map) continue;
        add(id, {map->a, map->jacobian, first_dark_ahead_ == ((place.x() + place.y()) % 2 == 0)});
      }
    }
  }

  FoundPattern found() {
    drop_strays(points_, [](double step_px) { return std::max(1.0, 0.06 * step_px); });
    std::sort(points_.begin(), points_.end(), [](const GridPoint& a, const GridPoint& b) { return a.id < b.id; });
    FoundPattern found;
    std::vector<double> contrasts;
    for (const GridPoint& point : points_) {
      const CrossLook& look = looks_[point.id];
      found.ids.push_back(point.id);
      found.points_px.push_back(point.px);
      found.edges.insert(found.edges.end(), look.edges.begin(), look.edges.end());
      contrasts.push_back(look.contrast);
    }
    found.contrast = median_of(contrasts);
    return found;
  }

 private:
  static bool has_neighbours(const std::vector<GridPoint>& known, const Eigen::Vector2i& place) {
    return std::count_if(known.begin(), known.end(), [&](const GridPoint& point) {
             return (point.place - place).cwiseAbs().maxCoeff() == 1;
           }) >= kNeighbours;
  }

  int columns_, rows_;
  double margin_;
  SmoothPicture smooth_;
  std::vector<GridPoint> points_;
  std::map<int, CrossLook> looks_;
  bool first_dark_ahead_ = false;
};

/// Corners between two tags that agree, refined, that look like corners, and what lies beside them.
FoundPattern corners_between(const Pattern& pattern, const GreyView& picture,
                             const std::map<int, Predicted>& predictions) {
  CornerSearch search(pattern, picture);
  for (const auto& [id, predicted] : predictions) {
    if (const auto cross = agreed(predicted)) search.add(id, *cross);
  }
  search.grow();
  return search.found();
}

void detect_tags(const Pattern& pattern, const cv::Mat& grey, std::vector<int>& ids,
                 std::vector<std::vector<cv::Point2f>>& quads) {
  const auto settings = cv::aruco::DetectorParameters::create();
  settings->minMarkerPerimeterRate = 0.015;
  cv::aruco::detectMarkers(grey, cv::aruco::getPredefinedDictionary(pattern.dictionary), quads, ids, settings);
}

/// How tags fit together where the pattern's counts were others.
struct Recount {
  Pattern pattern;
  int joined = 0;
};

/// Counts that are swapped, off by one, or both, with which clearly more corners join than with those that were told;
/// the nearest to these of several that fit alike. Even rows of the old layout differ from odd ones.
std::optional<Recount> recount(const Pattern& pattern, const std::vector<int>& ids,
                               const std::vector<std::vector<cv::Point2f>>& quads, int joined) {
  constexpr int kClearly = 6;  // corners; a misread tag joins or tears a corner or two
  std::optional<Recount> best;
  int least_changes = 0;
  for (const bool swapped : {false, true}) {
    for (int columns_more = -1; columns_more <= 1; ++columns_more) {
      for (int rows_more = -1; rows_more <= 1; ++rows_more) {
        for (const bool legacy : {pattern.legacy, !pattern.legacy}) {
          Pattern other = pattern;
          if (swapped) std::swap(other.columns, other.rows);
          other.columns += columns_more;
          other.rows += rows_more;
          other.legacy = legacy;
          const int changes = (swapped ? 1 : 0) + std::abs(columns_more) + std::abs(rows_more);
          if (changes == 0 || other.columns < 3 || other.rows < 3) continue;
          const int fits = joined_in(predict(other, ids, quads));
          const int ahead = best ? fits - best->joined : fits - joined - kClearly;
          if (ahead < 0 || (best && ahead == 0 && changes >= least_changes)) continue;
          best = Recount{other, fits};
          least_changes = changes;
        }
      }
    }
  }
  return best;
}

/// With an odd count of rows the two layouts are one.
LayoutEvidence evidence_of(const Pattern& pattern, const std::map<int, Predicted>& predictions,
                           const std::vector<int>& ids, const std::vector<std::vector<cv::Point2f>>& quads) {
  if (pattern.rows % 2 != 0) return {};
  Pattern other = pattern;
  other.legacy = !pattern.legacy;
  return {joined_in(predictions), joined_in(predict(other, ids, quads))};
}

FoundPattern miscounted(const Pattern& pattern, const Recount& other) {
  FoundPattern none;
  none.failure = fmt::format(
      "the tags fit together as on a board of {}x{} squares{}, not of {}x{}: give the counts in --board, columns first",
      other.pattern.columns, other.pattern.rows,
      other.pattern.legacy == pattern.legacy ? ""
      : other.pattern.legacy                 ? ":legacy"
                                             : " without :legacy",
      pattern.columns, pattern.rows);
  return none;
}

}  // namespace

FoundPattern find_charuco(const Pattern& pattern, const GreyView& picture, Search search) {
  const cv::Mat grey = mat_of(picture);
  std::vector<int> ids;
  std::vector<std::vector<cv::Point2f>> quads;
  detect_tags(pattern, grey, ids, quads);
  const auto predictions = predict(pattern, ids, quads);
  const LayoutEvidence layout = evidence_of(pattern, predictions, ids, quads);
  if (layout.is_other()) {
    if (const auto other = recount(pattern, ids, quads, layout.joined_in_other)) return miscounted(pattern, *other);
    FoundPattern none;
    none.layout = layout;
    none.failure = fmt::format("the tags lie as in the {} layout: {} :legacy in the pattern",
                               pattern.legacy ? "new" : "old", pattern.legacy ? "leave out" : "add");
    return none;
  }
  if (pattern.rows % 2 != 0) {
    // The rows' count says nothing but which squares the tags lie in, and is not seen to be wrong otherwise.
    Pattern even = pattern;
    even.rows += 1;
    even.legacy = true;
    const LayoutEvidence counts{joined_in(predictions), joined_in(predict(even, ids, quads))};
    if (counts.is_other()) {
      const auto other = recount(pattern, ids, quads, counts.joined);
      if (other && other->pattern.columns != pattern.columns) return miscounted(pattern, *other);
      FoundPattern none;
      none.failure = fmt::format(
          "the tags lie as in the old layout of an even count of rows, {} or {}, not {}: count the board's rows of "
          "squares, and add :legacy to the pattern",
          pattern.rows - 1, pattern.rows + 1, pattern.rows);
      return none;
    }
  }
  FoundPattern found = corners_between(pattern, picture, predictions);
  found.layout = layout;
  const std::size_t corners = found.ids.size();
  // By wrong counts some tags still lie beside their neighbours: corners enough, and each with a wrong place.
  if (const auto other = recount(pattern, ids, quads, std::max(0, joined_in(predictions))))
    return miscounted(pattern, *other);
  if (corners >= kLeastCorners) return found;
  cv::Mat mirrored;
  std::vector<int> mirrored_ids;
  if (search == Search::thorough) {
    cv::flip(grey, mirrored, 1);
    detect_tags(pattern, mirrored, mirrored_ids, quads);
  }
  if (mirrored_ids.size() > 2 * ids.size() + 4) {
    found.failure = "the picture is mirrored: its tags read only from behind; turn the mirroring off where it is made";
  } else if (ids.empty()) {
    found.failure = "no tag of the board is seen";
  } else {
    found.failure = fmt::format("too few corners are seen, {} of {} ({} tags); {} are needed", corners,
                                (pattern.columns - 1) * (pattern.rows - 1), ids.size(), kLeastCorners);
  }
  return found;
}

}  // namespace birdseye::calibration
