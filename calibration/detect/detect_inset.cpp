#include "calibration/detect/detect_inset.hpp"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <map>
#include <opencv2/calib3d.hpp>
#include <set>

#include "calibration/base/median.hpp"
#include "calibration/detect/corner_cross.hpp"

namespace birdseye::calibration {

namespace {

constexpr CrossReach kInsetReach{0.42, 0.25};
constexpr std::size_t kLeastOfBoard = 6;    // corners of the board that hold a map to the inset
constexpr std::size_t kLeastForCubic = 30;  // points that hold a map with the lens' distortion
constexpr std::size_t kLeastTogether = 12;  // as of a ChArUco board alone
constexpr double kNear_squares = 2.5;       // of the board: how far from a known point corners are looked for
constexpr int kMostInsetRounds = 20;
constexpr double kBorder_squares = 1;     // of the inset: as much white lies about it, or less
constexpr double kBeside_squares = 0.45;  // of the board: so far its corners' edges are used
constexpr double kLeastShare = 0.3;       // of the corners looked for; what is no inset has a few that look like it

/// A smooth map of the board to the picture: a homography, and where there are many points a cubic that takes what the
/// lens bends.
class BoardMap {
 public:
  BoardMap(const std::vector<Eigen::Vector2d>& board_mm, const std::vector<Eigen::Vector2d>& px) {
    std::vector<cv::Point2d> from, to;
    for (std::size_t i = 0; i < px.size(); ++i) {
      from.emplace_back(board_mm[i].x(), board_mm[i].y());
      to.emplace_back(px[i].x(), px[i].y());
      low_ = low_.cwiseMin(board_mm[i]);
      high_ = high_.cwiseMax(board_mm[i]);
    }
    const cv::Mat h = cv::findHomography(from, to, 0);
    if (h.empty()) return;
    for (int i = 0; i < 9; ++i) homography_(i / 3, i % 3) = h.at<double>(i / 3, i % 3);
    sound_ = homography_.allFinite();
    if (!sound_ || px.size() < kLeastForCubic) return;
    Eigen::MatrixXd terms(static_cast<Eigen::Index>(px.size()), kTerms), rest(terms.rows(), 2);
    for (std::size_t i = 0; i < px.size(); ++i) {
      terms.row(static_cast<Eigen::Index>(i)) = terms_at(board_mm[i]);
      rest.row(static_cast<Eigen::Index>(i)) = (px[i] - by_homography(board_mm[i])).transpose();
    }
    cubic_ = terms.colPivHouseholderQr().solve(rest);
  }

  [[nodiscard]] bool sound() const { return sound_; }
  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector2d& mm) const {
    return by_homography(mm) + (terms_at(mm) * cubic_).transpose();
  }

 private:
  static constexpr int kTerms = 10;

  [[nodiscard]] Eigen::Vector2d by_homography(const Eigen::Vector2d& mm) const {
    return (homography_ * mm.homogeneous()).hnormalized();
  }
  [[nodiscard]] Eigen::Matrix<double, 1, kTerms> terms_at(const Eigen::Vector2d& mm) const {
    const Eigen::Array2d u = 2 * (mm - low_).array() / (high_ - low_).array() - 1;
    const double x = u.x(), y = u.y();
    Eigen::Matrix<double, 1, kTerms> out;
    out << 1, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y;
    return out;
  }

  Eigen::Matrix3d homography_ = Eigen::Matrix3d::Identity();
  Eigen::Matrix<double, kTerms, 2> cubic_ = Eigen::Matrix<double, kTerms, 2>::Zero();
  Eigen::Vector2d low_ = Eigen::Vector2d::Constant(1e300), high_ = Eigen::Vector2d::Constant(-1e300);
  bool sound_ = false;
};

/// Looks for the inset's corners outwards from points that are known.
class InsetSearch {
 public:
  InsetSearch(const Pattern& pattern, const GreyView& picture, const FoundPattern& board)
      : pattern_(pattern), smooth_(picture), first_id_((pattern.columns - 1) * (pattern.rows - 1)) {
    for (const Eigen::Vector3d& p : pattern_points_mm(pattern)) places_mm_.emplace_back(p.head<2>());
    for (std::size_t i = 0; i < board.ids.size(); ++i) know(board.ids[i], board.points_px[i]);
  }

  /// dark_first: whether the square ahead of the first corner is dark.
  std::size_t run(bool dark_first) {
    for (int round = 0; round < kMostInsetRounds; ++round) {
      const BoardMap map(known_mm_, known_px_);
      const std::size_t before = points_.size();
      if (!map.sound()) break;
      for (int id = first_id_; id < static_cast<int>(places_mm_.size()); ++id) look_for(id, map, dark_first);
      if (points_.size() == before) break;
    }
    drop_strays(points_, [](double step_px) { return std::max(1.0, 0.06 * step_px); });
    const auto least = kLeastShare * static_cast<double>(looked_for_.size());
    return static_cast<double>(points_.size()) < least ? 0 : points_.size();
  }

  /// Of its corners, how many lie near enough to what is known to be looked for.
  [[nodiscard]] std::size_t looked_for() const { return looked_for_.size(); }

  void add_to(FoundPattern& found) const {
    std::vector<double> contrasts;
    for (const GridPoint& point : points_) {
      const CrossLook& look = looks_.at(point.id);
      found.ids.push_back(point.id);
      found.points_px.push_back(point.px);
      found.edges.insert(found.edges.end(), look.edges.begin(), look.edges.end());
      contrasts.push_back(look.contrast);
    }
    if (found.contrast == 0 && !contrasts.empty()) found.contrast = median_of(contrasts);
  }

 private:
  [[nodiscard]] const Eigen::Vector2d& place_of(int id) const { return places_mm_[static_cast<std::size_t>(id)]; }

  void know(int id, const Eigen::Vector2d& px) {
    known_mm_.push_back(place_of(id));
    known_px_.push_back(px);
  }

  void look_for(int id, const BoardMap& map, bool dark_first) {
    if (looks_.contains(id)) return;
    const Eigen::Vector2d& mm = place_of(id);
    const double near_mm = kNear_squares * pattern_.spacing_mm;
    if (std::none_of(known_mm_.begin(), known_mm_.end(), [&](const auto& p) { return (p - mm).norm() < near_mm; }))
      return;
    const Eigen::Vector2i place((id - first_id_) % pattern_.inset_columns, (id - first_id_) / pattern_.inset_columns);
    Cross cross;
    cross.centre_px = map(mm);
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d half_mm = 0.5 * pattern_.inset_mm * Eigen::Vector2d::Unit(axis);
      cross.px_per_square.col(axis) = map(mm + half_mm) - map(mm - half_mm);
    }
    looked_for_.insert(id);
    cross.dark_ahead = dark_first == ((place.x() + place.y()) % 2 == 0);
    const auto refined = refine_cross(smooth_.view(), cross, kInsetReach);
    if (!refined) return;
    cross.centre_px = *refined;
    CrossLook look = look_at_cross(smooth_.view(), cross, kInsetReach);
    if (!look.is_cross) return;
    points_.push_back({id, place, *refined});
    looks_.emplace(id, std::move(look));
    know(id, *refined);
  }

  const Pattern& pattern_;
  SmoothPicture smooth_;
  int first_id_;
  std::vector<Eigen::Vector2d> places_mm_, known_mm_, known_px_;
  std::vector<GridPoint> points_;
  std::map<int, CrossLook> looks_;
  std::set<int> looked_for_;
};

/// Takes away corners of the board that the inset covers, or comes so near that their edges end in its white.
void drop_covered(const Pattern& pattern, FoundPattern& found) {
  const auto places = pattern_points_mm(pattern);
  const Eigen::Array2d middle = 0.5 * pattern.spacing_mm * Eigen::Array2d(pattern.columns, pattern.rows);
  const Eigen::Array2d half =
      0.5 * pattern.inset_mm * Eigen::Array2d(pattern.inset_columns + 1, pattern.inset_rows + 1) +
      kBorder_squares * pattern.inset_mm + kBeside_squares * pattern.spacing_mm;
  FoundPattern kept = found;
  kept.ids.clear();
  kept.points_px.clear();
  for (std::size_t i = 0; i < found.ids.size(); ++i) {
    const Eigen::Array2d off = (places[static_cast<std::size_t>(found.ids[i])].head<2>().array() - middle).abs();
    if ((off < half).all()) continue;
    kept.ids.push_back(found.ids[i]);
    kept.points_px.push_back(found.points_px[i]);
  }
  found = std::move(kept);
}

}  // namespace

void add_inset(const Pattern& pattern, const GreyView& picture, FoundPattern& found) {
  drop_covered(pattern, found);
  if (found.ids.size() < kLeastOfBoard) return;
  // Which of its squares are dark nobody says: the picture does.
  InsetSearch dark(pattern, picture, found), light(pattern, picture, found);
  const std::size_t as_dark = dark.run(true), as_light = light.run(false);
  if (std::max(as_dark, as_light) > 0) (as_dark > as_light ? dark : light).add_to(found);
  found.inset = {std::max(dark.looked_for(), light.looked_for()), std::max(as_dark, as_light)};
  if (found.ids.size() >= kLeastTogether) found.failure.clear();
}

}  // namespace birdseye::calibration
