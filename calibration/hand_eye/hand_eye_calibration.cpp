#include "calibration/hand_eye/hand_eye_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/base/median.hpp"
#include "calibration/base/units.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/hand_eye/hand_eye_observability.hpp"
#include "calibration/hand_eye/hand_eye_refinement.hpp"
#include "calibration/hand_eye/hand_eye_start.hpp"
#include "calibration/hand_eye/hand_eye_stations.hpp"

namespace birdseye::calibration {

namespace {

/// One station in so many may be taken for an outlier by chance.
constexpr double kOutlierChance = 1e-4;
constexpr double kOutsideRegion = 0.05;
constexpr std::size_t kFewest = 3;

class Calibration {
 public:
  explicit Calibration(const HandEyeInput& in) : in_(in), freedom_{in.estimate_time_offset, false} {
    for (const HandEyeStation& s : in.stations) {
      HandEyeStationFit row;
      row.name = s.name;
      out_.stations.push_back(row);
    }
  }

  HandEyeResult run() {
    stations_ = prepare_stations(in_);
    out_.corner_sigma_px = stations_.corner_sigma_px;
    for (const auto& r : stations_.rejected) out_.stations[r.index].why_not = "rejected: " + r.why;
    sum_up();
    StationsInOrder order{
        summed_, {}, stations_.square_mm, in_.stations.front().camera_from_marker.has_value(), freedom_.time_offset};
    for (const PreparedStation& s : stations_.used) {
      HandEyeStationFit& row = out_.stations[s.index];
      row.view_rms_px = s.view_rms_px;
      row.corners_left_out = s.corners_left_out;
      order.rank.push_back(s.index);
    }
    out_.observability = observe_hand_eye(order, in_.tracker_noise);
    if (!out_.observability.solvable) return out_;
    if (fit_all() && refine()) {
      out_.solved = true;
      fill_table();
    } else {
      out_.observability.solvable = false;
      out_.observability.findings.push_back(
          {Grade::fail, "hand-eye does not converge", "see that poses and pictures are of the same moments"});
    }
    return out_;
  }

 private:
  /// Stations with a reason leave.
  void keep_only(const std::vector<std::string>& reasons) {
    std::vector<PreparedStation> kept;
    for (std::size_t i = 0; i < reasons.size(); ++i) {
      if (reasons[i].empty()) {
        kept.push_back(stations_.used[i]);
      } else {
        outliers_.push_back(stations_.used[i]);
        out_.stations[stations_.used[i].index].why_not = "outlier: " + reasons[i];
      }
    }
    stations_.used = std::move(kept);
    sum_up();
  }

  void sum_up() {
    summed_.clear();
    for (const PreparedStation& s : stations_.used) summed_.push_back(s.summed);
  }

  /// Tracked reprojection, px; without corners the distance of the board's origin, mm.
  [[nodiscard]] double score(const ChainState& state) const {
    double squares = 0, count = 0;
    for (const PreparedStation& p : stations_.used) {
      const auto pose = tracked_view(p.corners.chain, state);
      if (p.corners.corners.empty()) {
        squares += (pose.translation() - p.summed.camera_from_marker.translation()).squaredNorm();
        count += 1;
        continue;
      }
      const auto sum = sum_corners(p.corners.corners, pose, 1);
      const double behind_px = in_.camera->width_px + in_.camera->height_px;
      const auto corners = static_cast<double>(stations_.views[p.index].points_px.size() +
                                               stations_.right_views[p.index].points_px.size());
      squares += sum ? sum->squares : behind_px * behind_px * corners;
      count += corners;
    }
    return std::sqrt(squares / count);
  }

  ChainState best_start() {
    out_.starts = closed_forms(summed_);
    ChainState best;
    double least = std::numeric_limits<double>::infinity();
    for (HandEyeStart& start : out_.starts) {
      if (!start.failed.empty()) continue;
      ChainState state;
      state.camera_from_sensor = start.camera_from_sensor;
      state.body_from_marker = body_from_marker_of(summed_, start.camera_from_sensor);
      start.score = score(state);
      if (start.score < least) {
        least = start.score;
        best = state;
        out_.start = start.method;
      }
    }
    return best;
  }

  /// Fits with the outliers that it finds put aside, twice: the first may have hidden others, and closed forms do not
  /// bear them.
  bool fit_all() {
    for (int round = 0; round < 2; ++round) {
      const ChainState start = best_start();
      if (out_.start.empty()) return false;
      for (const PreparedStation& p : stations_.used)
        fit_.residuals.push_back(chain_residual(p.summed.chain, p.summed.camera_from_marker, start).value);
      fit_.state = start;
      for (int i = 0; i < 5; ++i) {
        noise_ = in_.tracker_noise.value_or(TrackerNoise{});
        const TrackerNoise median = median_noise(fit_.residuals, freedom_);
        noise_.position_sigma_mm = std::max(noise_.position_sigma_mm, median.position_sigma_mm);
        noise_.angle_sigma_rad = std::max(noise_.angle_sigma_rad, median.angle_sigma_rad);
        fit_ = fit_chain(summed_, fit_.state, noise_, freedom_, true);
        if (!fit_.converged) return false;
      }
      if (!drop_outliers()) break;
      fit_.residuals.clear();
    }
    if (in_.tracker_noise) {
      noise_ = *in_.tracker_noise;
      fit_ = fit_chain(summed_, fit_.state, noise_, freedom_, false);
    } else {
      noise_ = estimate_noise(summed_, fit_, noise_, freedom_);
      out_.noise_estimated = true;
    }
    out_.tracker_noise = noise_;
    return fit_.converged;
  }

  [[nodiscard]] double residual_freedom() const {
    return 6 * static_cast<double>(summed_.size()) - freedom_.parameters();
  }

  bool drop_outliers() {
    const double limit = distance_limit(kOutlierChance, residual_freedom());
    std::vector<std::string> reasons(stations_.used.size());
    std::size_t found = 0;
    for (std::size_t i = 0; i < stations_.used.size(); ++i) {
      const auto held = hold_out(summed_, i, fit_, noise_, freedom_, true);
      if (!held || held->distance_squared <= limit) continue;
      HandEyeStationFit& row = out_.stations[stations_.used[i].index];
      row.distance_squared = held->distance_squared;
      reasons[i] = fmt::format("off by {:.1f} sigmas", std::sqrt(held->distance_squared / 6));
      ++found;
    }
    if (found == 0 || stations_.used.size() - found < kFewest + 1) return false;
    keep_only(reasons);
    return true;
  }

  bool refine() {
    Eigen::MatrixXd covariance = fit_.covariance;
    out_.cost_trace = fit_.cost_trace;
    refined_ = fit_.state;
    if (!stations_.used.front().corners.corners.empty()) {
      std::vector<CornerStation> corners;
      std::vector<Transform<Camera, Marker>> starts;
      for (const PreparedStation& p : stations_.used) {
        corners.push_back(p.corners);
        starts.push_back(p.summed.camera_from_marker);
      }
      const auto full =
          refine_hand_eye(corners, starts, fit_.state, noise_, out_.corner_sigma_px, freedom_.time_offset);
      if (!full) return false;
      refined_ = full->state;
      covariance = full->covariance;
      out_.cost_trace = full->cost_trace;
      double squares = 0, count = 0;
      for (std::size_t i = 0; i < corners.size(); ++i) {
        const auto sum = sum_corners(corners[i].corners, full->camera_from_marker[i], out_.corner_sigma_px);
        if (!sum) return false;
        squares += sum->squares;
        count += static_cast<double>(sum->errors_px.size());
      }
      out_.rms_px = std::sqrt(squares / count);
    }
    if (!out_.noise_estimated) {
      const ChainNormal normal = chain_normal(summed_, refined_, noise_, freedom_, false);
      out_.variance_factor = 2 * normal.cost / std::max(1.0, residual_freedom());
    }
    const double factor = std::max(1.0, out_.variance_factor);
    out_.camera_from_sensor = refined_.camera_from_sensor;
    out_.body_from_marker = refined_.body_from_marker;
    out_.covariance = factor * covariance.topLeftCorner<6, 6>();
    if (freedom_.time_offset) {
      out_.time_offset_s = refined_.time_offset_s;
      out_.time_offset_sigma_s = std::sqrt(factor * covariance(12, 12));
    }
    constexpr double kKnown = 1e6;  // residuals enough for the noise to be known
    const bool known = !out_.noise_estimated && out_.variance_factor <= 1;
    out_.region_limit = distance_limit(kOutsideRegion, known ? kKnown : residual_freedom());
    return out_.covariance.allFinite();
  }

  /// Errors of one station, with hand-eye as given.
  struct Tracked {
    double px = 0, mm = 0, squares_px = 0, squares_mm = 0, count = 0;
    std::vector<Eigen::Vector2d> seen, predicted;
  };
  [[nodiscard]] Tracked tracked(const PreparedStation& p, const ChainState& state) const {
    Tracked out;
    const auto pose = tracked_view(p.corners.chain, state);
    if (p.corners.corners.empty()) {
      out.squares_mm = (pose.translation() - p.summed.camera_from_marker.translation()).squaredNorm();
      out.count = 1;
    }
    for (const SeenCorners& corners : p.corners.corners) {
      for (std::size_t i = 0; i < corners.view->points_px.size(); ++i) {
        const Eigen::Vector3d point = corners.lens_from_camera * (pose * corners.view->points_in_marker_mm[i]);
        const auto pixel = project(*corners.camera, point);
        const auto ray = unproject(*corners.camera, corners.view->points_px[i]);
        out.count += 1;
        if (!pixel || !ray) {
          out.squares_px = out.squares_mm = std::numeric_limits<double>::infinity();
          continue;
        }
        out.squares_px += (*pixel - corners.view->points_px[i]).squaredNorm();
        out.squares_mm += (point.head<2>() - ray->head<2>() * point.z()).squaredNorm();
        if (&corners != p.corners.corners.data()) continue;
        out.seen.push_back(corners.view->points_px[i]);
        out.predicted.push_back(*pixel);
      }
    }
    out.px = std::sqrt(out.squares_px / out.count);
    out.mm = std::sqrt(out.squares_mm / out.count);
    return out;
  }

  void fill_row(const PreparedStation& p, const ChainState& held_out) {
    HandEyeStationFit& row = out_.stations[p.index];
    row.camera_from_marker = p.summed.camera_from_marker;
    row.tracked_px = tracked(p, refined_).px;
    Tracked held = tracked(p, held_out);
    row.held_out_px = held.px;
    row.held_out_mm = held.mm;
    row.seen_px = std::move(held.seen);
    row.tracked_corner_px = std::move(held.predicted);
    const Vector6d r = chain_residual(p.summed.chain, p.summed.camera_from_marker, refined_).value;
    row.turn_off_deg = r.head<3>().norm() * kDegPerRad;
    row.shift_off_mm = r.tail<3>().norm();
  }

  void fill_table() {
    fit_.state = refined_;
    double all_px = 0, all_mm = 0, all_tracked = 0, count = 0;
    std::vector<double> distances, held_out;
    for (std::size_t i = 0; i < stations_.used.size(); ++i) {
      const PreparedStation& p = stations_.used[i];
      HandEyeStationFit& row = out_.stations[p.index];
      row.used = true;
      const auto held = hold_out(summed_, i, fit_, noise_, freedom_, false);
      fill_row(p, held ? held->state : refined_);
      row.distance_squared = held ? held->distance_squared : std::numeric_limits<double>::infinity();
      const Tracked all = tracked(p, refined_);
      all_px += row.held_out_px * row.held_out_px * all.count;
      all_mm += row.held_out_mm * row.held_out_mm * all.count;
      all_tracked += all.squares_px;
      count += all.count;
      held_out.push_back(row.held_out_px);
      distances.push_back(p.summed.camera_from_marker.translation().norm());
    }
    out_.held_out_px = std::sqrt(all_px / count);
    out_.held_out_mm = std::sqrt(all_mm / count);
    out_.tracked_px = std::sqrt(all_tracked / count);
    out_.working_distance_mm = median_of(distances);
    out_.held_out_median_px = median_of(held_out);
    std::sort(outliers_.begin(), outliers_.end(), [](const auto& a, const auto& b) { return a.index < b.index; });
    for (const PreparedStation& p : outliers_) {
      fill_row(p, refined_);
      out_.outliers.push_back(out_.stations[p.index].name);
    }
  }

  const HandEyeInput& in_;
  ChainFreedom freedom_;
  HandEyeResult out_;
  HandEyeStations stations_;
  std::vector<PreparedStation> outliers_;
  std::vector<SummedStation> summed_;
  ChainFit fit_;
  TrackerNoise noise_;
  ChainState refined_;
};

}  // namespace

Eigen::Vector3d HandEyeResult::rotation_sigma_deg() const {
  return covariance.diagonal().head<3>().cwiseSqrt() * kDegPerRad;
}
Eigen::Vector3d HandEyeResult::translation_sigma_mm() const {
  return covariance.diagonal().tail<3>().cwiseSqrt();
}

double HandEyeResult::sigma_at_board_mm() const {
  // A point p straight ahead, held by the sensor, is off by e x (p - t) + d.
  const Eigen::Vector3d ahead(0, 0, working_distance_mm);
  Eigen::Matrix<double, 3, 6> by;
  by << -cross_matrix(ahead - camera_from_sensor.translation()), Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d at_point = by * covariance * by.transpose();
  return std::sqrt(0.5 * (at_point(0, 0) + at_point(1, 1)));
}

Result<HandEyeResult> calibrate_hand_eye(const HandEyeInput& input) {
  if (const auto ok = check_stations(input); !ok) return ok.error();
  return Calibration(input).run();
}

}  // namespace birdseye::calibration
