#include "calibration/camera/stereo_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/base/median.hpp"
#include "calibration/base/units.hpp"
#include "calibration/camera/camera_views.hpp"
#include "calibration/camera/stereo_bundle.hpp"

namespace birdseye::calibration {

namespace {

/// A view of one camera's calibration as the joint fit takes it: its sound points, and where it puts the board.
BundleView view_of(const CameraCalibration& one, std::size_t at, const PatternView& given) {
  BundleView out;
  out.camera_from_marker = one.camera_from_marker[at];
  for (const FittedPoint& point : one.points) {
    if (point.view != at || point.outlier) continue;
    const auto k =
        static_cast<std::size_t>(std::find(given.ids.begin(), given.ids.end(), point.id) - given.ids.begin());
    out.points_mm.push_back(given.points_in_marker_mm[k]);
    out.points_px.push_back(point.pixel_px);
    out.weights.push_back(1);
  }
  return out;
}

std::optional<std::size_t> used_at(const CameraCalibration& one, std::size_t index) {
  for (std::size_t v = 0; v < one.views.size(); ++v) {
    if (one.views[v].index == index) return v;
  }
  return std::nullopt;
}

Transform<RightCamera, Camera> relation_of(const BundlePair& pair) {
  const Transform<RightCamera, Marker> right(pair.right.camera_from_marker.rotation(),
                                             pair.right.camera_from_marker.translation());
  return right * pair.left.camera_from_marker.inverse();
}

/// The one of the pairs' relations that is nearest to all others': no mean, which one bad pair would move.
Transform<RightCamera, Camera> middle_relation(std::span<const BundlePair> pairs) {
  double least = HUGE_VAL;
  Transform<RightCamera, Camera> out;
  for (const BundlePair& a : pairs) {
    const auto candidate = relation_of(a);
    double sum = 0;
    for (const BundlePair& b : pairs) {
      const auto difference = relation_of(b) * candidate.inverse();
      // As far as the two move the board's origin.
      const Eigen::Vector3d at_mm = a.right.camera_from_marker.translation();
      sum += (difference * at_mm - at_mm).norm();
    }
    if (sum < least) {
      least = sum;
      out = candidate;
    }
  }
  return out;
}

double rms(const std::vector<Eigen::Vector2d>& residuals) {
  double squares = 0;
  for (const Eigen::Vector2d& r : residuals) squares += r.squaredNorm();
  return std::sqrt(squares / static_cast<double>(residuals.size()));
}

/// How far a pair is off with the relation of most and its own board's place: in px of the right picture.
std::vector<double> disagreement_px(const StereoBundle& bundle) {
  std::vector<double> out;
  for (const BundlePair& pair : bundle.pairs) out.push_back(rms(right_residuals_px(bundle, pair)));
  return out;
}

/// Keeps the pairs that agree with most; the others are named.
void reject_pairs(StereoBundle& bundle, std::span<const PatternView> left_views, StereoCalibration& out) {
  constexpr double kTimes = 5;
  const std::vector<double> off_px = disagreement_px(bundle);
  const double least_px = 1.0 / 1920 * bundle.right.width_px;  // that much each camera's own pose may be off
  const double limit_px = kTimes * std::max(median_of(off_px), least_px);
  std::vector<BundlePair> kept;
  std::vector<std::size_t> kept_pairs;
  for (std::size_t p = 0; p < off_px.size(); ++p) {
    if (off_px[p] > limit_px) {
      const std::size_t index = out.pairs[p];
      out.rejected.push_back(
          {index, left_views[index].name,
           fmt::format("left and right do not see the board at one place ({:.1f} px apart): it moved "
                       "between the two, or they are no pair",
                       off_px[p])});
    } else {
      kept.push_back(bundle.pairs[p]);
      kept_pairs.push_back(out.pairs[p]);
    }
  }
  bundle.pairs = std::move(kept);
  out.pairs = std::move(kept_pairs);
}

double held_out_px(const StereoBundle& bundle, int most_folds) {
  const std::size_t folds = std::min(bundle.pairs.size(), static_cast<std::size_t>(std::max(2, most_folds)));
  double squares = 0;
  std::size_t points = 0;
  for (std::size_t fold = 0; fold < folds; ++fold) {
    StereoBundle others = bundle;
    others.pairs.clear();
    for (std::size_t p = 0; p < bundle.pairs.size(); ++p) {
      if (p % folds != fold) others.pairs.push_back(bundle.pairs[p]);
    }
    refine_stereo(others, {.most_steps = 12, .tolerance = 1e-9});
    for (std::size_t p = fold; p < bundle.pairs.size(); p += folds) {
      BundlePair pair = bundle.pairs[p];
      pair.left.camera_from_marker = fit_pose(others.left, pair.left);
      for (const Eigen::Vector2d& r : right_residuals_px(others, pair)) {
        squares += r.squaredNorm();
        ++points;
      }
    }
  }
  return std::sqrt(squares / static_cast<double>(points));
}

/// Distances of the right picture's points from the epipolar lines of the left one's, in px of the undistorted picture.
double epipolar_rms_px(const StereoBundle& bundle) {
  const Eigen::Vector3d& t = bundle.right_from_left.translation();
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  const Eigen::Matrix3d essential = cross * bundle.right_from_left.rotation();
  double squares = 0;
  std::size_t count = 0;
  for (const BundlePair& pair : bundle.pairs) {
    for (std::size_t i = 0; i < pair.left.points_mm.size(); ++i) {
      const auto same = std::find(pair.right.points_mm.begin(), pair.right.points_mm.end(), pair.left.points_mm[i]);
      if (same == pair.right.points_mm.end()) continue;
      const auto k = static_cast<std::size_t>(same - pair.right.points_mm.begin());
      const auto left = unproject(bundle.left, pair.left.points_px[i]);
      const auto right = unproject(bundle.right, pair.right.points_px[k]);
      if (!left || !right) continue;
      const Eigen::Vector3d line = essential * *left;
      const double off = right->dot(line) / line.head<2>().norm() * bundle.right.fx_px;
      squares += off * off;
      ++count;
    }
  }
  return count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0;
}

void take_over(const StereoBundle& bundle, StereoCalibration& out) {
  out.left.camera = bundle.left;
  out.right.camera = bundle.right;
  out.right_from_left = bundle.right_from_left;
  out.baseline_mm = bundle.right_from_left.translation().norm();
  double squares = 0, points = 0;
  for (std::size_t p = 0; p < bundle.pairs.size(); ++p) {
    const BundlePair& pair = bundle.pairs[p];
    for (const auto& residuals : {residuals_px(bundle.left, pair.left), right_residuals_px(bundle, pair)}) {
      for (const Eigen::Vector2d& r : residuals) squares += r.squaredNorm();
      points += static_cast<double>(residuals.size());
    }
    const auto right = bundle.right_from_left * pair.left.camera_from_marker;
    out.left.camera_from_marker[*used_at(out.left, out.pairs[p])] = pair.left.camera_from_marker;
    out.right.camera_from_marker[*used_at(out.right, out.pairs[p])] = {right.rotation(), right.translation()};
  }
  out.rms_px = std::sqrt(squares / points);
  const auto solved = static_cast<double>(std::count(bundle.left_solved.begin(), bundle.left_solved.end(), true) +
                                          std::count(bundle.right_solved.begin(), bundle.right_solved.end(), true));
  const double freedom = 2 * points - solved - 6 - 6 * static_cast<double>(bundle.pairs.size());
  out.covariance = squares / std::max(freedom, 1.0) * relation_cofactor(bundle);
}

}  // namespace

Result<StereoCalibration> calibrate_stereo(std::span<const PatternView> left_views,
                                           std::span<const PatternView> right_views, Eigen::Vector2i left_size_px,
                                           Eigen::Vector2i right_size_px, const CameraCalibrationSettings& settings) {
  if (left_views.size() != right_views.size()) {
    return Error{Errc::bad_value, fmt::format("{} views of the left camera and {} of the right: give pairs",
                                              left_views.size(), right_views.size())};
  }
  auto left = calibrate_camera(left_views, left_size_px.x(), left_size_px.y(), settings);
  if (!left) return left.error().with_context("left camera");
  auto right = calibrate_camera(right_views, right_size_px.x(), right_size_px.y(), settings);
  if (!right) return right.error().with_context("right camera");
  StereoCalibration out;
  out.left = *std::move(left);
  out.right = *std::move(right);
  StereoBundle bundle;
  bundle.left = out.left.camera;
  bundle.right = out.right.camera;
  bundle.left_solved = solved_by(out.left.model);
  bundle.right_solved = solved_by(out.right.model);
  for (std::size_t i = 0; i < left_views.size(); ++i) {
    const auto l = used_at(out.left, i), r = used_at(out.right, i);
    if (!l || !r) {
      if (l || r)
        out.rejected.push_back(
            {i, left_views[i].name, l ? "not used of the right camera" : "not used of the left camera"});
      continue;
    }
    bundle.pairs.push_back({view_of(out.left, *l, left_views[i]), view_of(out.right, *r, right_views[i])});
    out.pairs.push_back(i);
  }
  if (bundle.pairs.size() >= kLeastViews) {
    bundle.right_from_left = middle_relation(bundle.pairs);
    if (settings.robust) reject_pairs(bundle, left_views, out);
  }
  if (bundle.pairs.size() < kLeastViews)
    return Error{Errc::degenerate, fmt::format("{} pairs of views in which both cameras see the board, of at least {}: "
                                               "take more",
                                               bundle.pairs.size(), kLeastViews)};
  refine_stereo(bundle);
  take_over(bundle, out);
  out.held_out_px = held_out_px(bundle, settings.folds);
  out.epipolar_rms_px = epipolar_rms_px(bundle);
  return out;
}

Verdict judge_stereo(const StereoCalibration& c) {
  Verdict verdict;
  for (const auto& [camera, name] : {std::pair(&c.left, "left"), std::pair(&c.right, "right")}) {
    const Verdict own = judge_camera(*camera);
    verdict.grade = std::max(verdict.grade, own.grade);
    for (const std::string& reason : own.reasons) verdict.reasons.push_back(fmt::format("{}: {}", name, reason));
    for (const std::string& step : own.next_steps) {
      if (std::find(verdict.next_steps.begin(), verdict.next_steps.end(), step) == verdict.next_steps.end())
        verdict.next_steps.push_back(step);
    }
  }
  const double scale = c.right.camera.width_px / camera_limits::kWidth_px;
  const std::string more = "take more pairs, with the board near and tilted, both pictures at the same moment";
  verdict.judge("held-out error of the pair", c.held_out_px, "px", scale * camera_limits::kHeldOutPass_px,
                scale * camera_limits::kHeldOutMarginal_px, more);
  const double turn_deg = std::sqrt(c.covariance.topLeftCorner<3, 3>().diagonal().maxCoeff()) * kDegPerRad;
  verdict.judge("turn between the cameras known to", turn_deg, "degrees", stereo_limits::kTurnSigmaPass_deg,
                stereo_limits::kTurnSigmaMarginal_deg, more);
  const Eigen::Vector3d along = c.right_from_left.translation().normalized();
  const double baseline_mm = std::sqrt(along.dot(c.covariance.bottomRightCorner<3, 3>() * along));
  verdict.judge("baseline known to", 100 * baseline_mm / c.baseline_mm, "%", 100 * stereo_limits::kBaselineSigmaPass,
                100 * stereo_limits::kBaselineSigmaMarginal, more);
  if (c.pairs.size() < stereo_limits::kPairsPass) {
    verdict.add(c.pairs.size() < stereo_limits::kPairsMarginal ? Grade::fail : Grade::marginal,
                fmt::format("pairs used: {}, less than {}", c.pairs.size(), stereo_limits::kPairsPass), more);
  }
  for (const RejectedView& pair : c.rejected) verdict.add(Grade::pass, pair.name + " rejected: " + pair.reason);
  return verdict;
}

}  // namespace birdseye::calibration
