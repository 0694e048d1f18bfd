#include "calibration/hand_eye/hand_eye_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "calibration/base/units.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/hand_eye/hand_eye_blocks.hpp"
#include "calibration/hand_eye/hand_eye_lens.hpp"
#include "calibration/hand_eye/hand_eye_observability.hpp"
#include "calibration/hand_eye/hand_eye_refinement.hpp"
#include "calibration/hand_eye/hand_eye_robust_fit.hpp"
#include "calibration/hand_eye/hand_eye_stations.hpp"
#include "calibration/hand_eye/hand_eye_step.hpp"
#include "calibration/hand_eye/hand_eye_table.hpp"

namespace birdseye::calibration {

namespace {

/// Over all corners, where there are any. Tells the answer and its covariance in the result. Empty if it does not
/// converge.
std::optional<ChainState> refine(const HandEyeStations& stations, const ChainFreedom& freedom, const RobustFit& robust,
                                 HandEyeResult& out) {
  Eigen::MatrixXd covariance = robust.fit.covariance;
  out.cost_trace = robust.fit.cost_trace;
  ChainState refined = robust.fit.state;
  if (!stations.used.front().corners.corners.empty()) {
    std::vector<CornerStation> corners;
    std::vector<Transform<Camera, Marker>> starts;
    for (const PreparedStation& p : stations.used) {
      corners.push_back(p.corners);
      starts.push_back(p.summed.camera_from_marker);
    }
    const auto full =
        refine_hand_eye(corners, starts, robust.fit.state, robust.noise, out.corner_sigma_px, freedom.time_offset);
    if (!full) return std::nullopt;
    refined = full->state;
    covariance = full->covariance;
    out.cost_trace = full->cost_trace;
    double squares = 0, count = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const auto sum = sum_corners(corners[i].corners, full->camera_from_marker[i], out.corner_sigma_px);
      if (!sum) return std::nullopt;
      squares += sum->squares;
      count += static_cast<double>(sum->errors_px.size());
    }
    out.rms_px = std::sqrt(squares / count);
  }
  if (!out.noise_estimated) {
    const ChainNormal normal = chain_normal(robust.summed, refined, robust.noise, freedom, false);
    out.variance_factor = 2 * normal.cost / std::max(1.0, freedom.of_residuals(robust.summed.size()));
  }
  const double factor = std::max(1.0, out.variance_factor);
  out.camera_from_sensor = refined.camera_from_sensor;
  out.body_from_marker = refined.body_from_marker;
  out.covariance = factor * covariance.topLeftCorner<6, 6>();
  if (freedom.time_offset) {
    out.time_offset_s = refined.time_offset_s;
    out.time_offset_sigma_s = std::sqrt(factor * covariance(12, 12));
  }
  constexpr double kKnown = 1e6;  // residuals enough for the noise to be known
  const bool known = !out.noise_estimated && out.variance_factor <= 1;
  out.region_limit = distance_limit(kOutsideRegion, known ? kKnown : freedom.of_residuals(robust.summed.size()));
  if (!out.covariance.allFinite()) return std::nullopt;
  return refined;
}

HandEyeResult calibrate(const HandEyeInput& in) {
  HandEyeResult out;
  for (const HandEyeStation& s : in.stations) {
    HandEyeStationFit row;
    row.name = s.name;
    out.stations.push_back(row);
  }
  const ChainFreedom freedom{in.estimate_time_offset, false};
  HandEyeStations stations = prepare_stations(in);
  out.corner_sigma_px = stations.corner_sigma_px;
  for (const auto& r : stations.rejected) out.stations[r.index].why_not = "rejected: " + r.why;
  const std::vector<SummedStation> summed = summed_of(stations.used);
  StationsInOrder order{summed,
                        {},
                        stations.square_mm,
                        in.stations.front().camera_from_marker.has_value(),
                        freedom.time_offset,
                        in.sensor_inverted,
                        in.eye_inverted};
  for (const PreparedStation& s : stations.used) {
    HandEyeStationFit& row = out.stations[s.index];
    row.view_rms_px = s.view_rms_px;
    row.corners_left_out = s.corners_left_out;
    order.rank.push_back(s.index);
  }
  out.observability = observe_hand_eye(order, in.tracker_noise);
  if (!out.observability.solvable) return out;
  const auto robust = fit_robustly(in, freedom, stations, out);
  const auto refined = robust ? refine(stations, freedom, *robust, out) : std::nullopt;
  if (refined) {
    out.solved = true;
    const CorrelatedStations blocks = fit_without_blocks(in, stations, freedom, *refined, *robust);
    widen_by_blocks(blocks, *refined, out);
    out.independent_stations = static_cast<int>(blocks.in_time.without.size());
    fill_station_table(stations, freedom, *refined, *robust, blocks.in_time, out);
    out.step = find_step(in, stations, freedom, robust->fit.state, *robust, out.working_distance_mm);
    add_lens_error(in, stations, freedom, *refined, *robust, out);
  } else {
    out.observability.solvable = false;
    out.observability.findings.push_back(
        {Grade::fail, "hand-eye does not converge", "see that poses and pictures are of the same moments"});
  }
  return out;
}

}  // namespace

Eigen::Vector3d HandEyeResult::rotation_sigma_deg() const {
  return covariance.diagonal().head<3>().cwiseSqrt() * kDegPerRad;
}
Eigen::Vector3d HandEyeResult::translation_sigma_mm() const {
  return covariance.diagonal().tail<3>().cwiseSqrt();
}

double HandEyeResult::sigma_at_board_mm(const Matrix6d& part) const {
  // A point p straight ahead, held by the sensor, is off by e x (p - t) + d.
  const Eigen::Vector3d ahead(0, 0, working_distance_mm);
  Eigen::Matrix<double, 3, 6> by;
  by << -cross_matrix(ahead - camera_from_sensor.translation()), Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d at_point = by * part * by.transpose();
  return std::sqrt(0.5 * (at_point(0, 0) + at_point(1, 1)));
}

Result<HandEyeResult> calibrate_hand_eye(const HandEyeInput& input) {
  if (const auto ok = check_stations(input); !ok) return ok.error();
  return calibrate(input);
}

}  // namespace birdseye::calibration
