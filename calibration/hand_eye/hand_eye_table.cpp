#include "calibration/hand_eye/hand_eye_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "calibration/base/median.hpp"
#include "calibration/base/units.hpp"
#include "calibration/hand_eye/hand_eye_fit.hpp"
#include "calibration/hand_eye/tracked_errors.hpp"

namespace birdseye::calibration {

namespace {

void fill_row(const PreparedStation& p, const ChainState& refined, const ChainState& held_out, HandEyeResult& out) {
  HandEyeStationFit& row = out.stations[p.index];
  row.camera_from_marker = p.summed.camera_from_marker;
  row.tracked_px = tracked_errors(p, refined).px;
  TrackedErrors held = tracked_errors(p, held_out);
  row.held_out_px = held.px;
  row.held_out_mm = held.mm;
  row.seen_px = std::move(held.seen);
  row.tracked_corner_px = std::move(held.predicted);
  const Vector6d r = chain_residual(p.summed.chain, p.summed.camera_from_marker, refined).value;
  row.turn_off_deg = r.head<3>().norm() * kDegPerRad;
  row.shift_off_mm = r.tail<3>().norm();
}

}  // namespace

void fill_station_table(const HandEyeStations& stations, const ChainFreedom& freedom, const ChainState& refined,
                        const RobustFit& robust, const HandEyeBlocks& blocks, HandEyeResult& out) {
  double all_px = 0, all_mm = 0, all_tracked = 0, count = 0;
  std::vector<double> distances, held_out;
  for (std::size_t i = 0; i < stations.used.size(); ++i) {
    const PreparedStation& p = stations.used[i];
    HandEyeStationFit& row = out.stations[p.index];
    row.used = true;
    const auto& without = blocks.without[blocks.block_of[i]];
    fill_row(p, refined, without ? without->state : refined, out);
    row.distance_squared =
        without ? distance_squared(p.summed, *without, robust.noise, freedom) : std::numeric_limits<double>::infinity();
    const TrackedErrors all = tracked_errors(p, refined);
    all_px += row.held_out_px * row.held_out_px * all.count;
    all_mm += row.held_out_mm * row.held_out_mm * all.count;
    all_tracked += all.squares_px;
    count += all.count;
    held_out.push_back(row.held_out_px);
    distances.push_back(p.summed.camera_from_marker.translation().norm());
  }
  out.held_out_px = std::sqrt(all_px / count);
  out.held_out_mm = std::sqrt(all_mm / count);
  out.tracked_px = std::sqrt(all_tracked / count);
  out.working_distance_mm = median_of(distances);
  out.held_out_median_px = median_of(held_out);
  std::vector<PreparedStation> outliers = robust.outliers;
  std::ranges::sort(outliers, {}, &PreparedStation::index);
  for (const PreparedStation& p : outliers) {
    fill_row(p, refined, refined, out);
    out.outliers.push_back(out.stations[p.index].name);
  }
}

}  // namespace birdseye::calibration
