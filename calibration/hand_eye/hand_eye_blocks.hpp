#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "calibration/hand_eye/hand_eye_fit.hpp"
#include "calibration/hand_eye/hand_eye_robust_fit.hpp"
#include "calibration/hand_eye/hand_eye_stations.hpp"

namespace birdseye::calibration {

/// The stations in blocks, and the fit without each block.
struct HandEyeBlocks {
  std::vector<std::size_t> block_of;  ///< of each station that is used
  std::vector<std::optional<FitWithout>> without;
};

/// Stations of a stream that may err together: neighbours in time, for the tracker's filter and a scope that has not
/// moved on push them alike; and neighbours in pose, for the field and a tilted view do. Stations without times were
/// taken one by one, and each is a block of its own.
struct CorrelatedStations {
  HandEyeBlocks in_time;
  std::optional<HandEyeBlocks> in_pose;  ///< of a stream
};

/// refined: the answer, from which each fit starts.
CorrelatedStations fit_without_blocks(const HandEyeInput& input, const HandEyeStations& stations,
                                      const ChainFreedom& freedom, const ChainState& refined, const RobustFit& robust);

/// The covariance of a stream's hand-eye, its region's limit and the time offset's sigma by how far the answer moves
/// when blocks are left out, where that says more than the residuals taken for independent: jackknife over blocks (B.
/// Efron and C. Stein, 1981; H. Kuensch, 1989), two ways (A. Cameron, J. Gelbach and D. Miller, 2011). A dozen blocks
/// hardly tell 21 numbers, so that the jackknife's covariance is drawn towards a multiple of the independent one.
/// Nothing changes where the stations are no stream.
void widen_by_blocks(const CorrelatedStations& blocks, const ChainState& refined, HandEyeResult& out);

}  // namespace birdseye::calibration
