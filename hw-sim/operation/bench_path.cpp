#include "hw-sim/operation/bench_path.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "hw-sim/world/between.hpp"
#include "hw-sim/world/board_stations.hpp"
#include "hw-sim/world/ease.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr std::size_t kStations = 24;
constexpr double kRests_s = 0.6, kMoves_s = 0.8;  // at a station, and to the next

}  // namespace

const Chessboard& BenchPath::board() {
  static const Chessboard board{7, 4, 11};
  return board;
}

double BenchPath::round_s() {
  return static_cast<double>(kStations) * (kRests_s + kMoves_s);
}

std::string BenchPath::spec() {
  return fmt::format("chessboard:{}x{}:{:g}mm", board().columns, board().rows, board().square_mm);
}

Result<BenchPath> BenchPath::create(const Transform<Tracker, Marker>& tracker_from_marker, const CameraModel& lens,
                                    std::uint64_t seed) {
  const auto stations = stations_over(board(), lens, seed, kStations);
  if (stations.size() < kStations)
    return Error{Errc::degenerate,
                 fmt::format("the scope sees the whole board from {} stations only, of {}: take another seed",
                             stations.size(), kStations)};
  BenchPath path;
  path.tracker_from_marker_ = tracker_from_marker;
  for (const auto& station : stations) path.stations_.push_back(tracker_from_marker * station);
  return path;
}

Transform<Tracker, Camera> BenchPath::at(double at_s) const {
  const double beat = std::floor(at_s / (kRests_s + kMoves_s));
  const double into_s = at_s - beat * (kRests_s + kMoves_s);
  const auto station = static_cast<std::size_t>(std::max(0.0, beat)) % stations_.size();
  return between(stations_[station], stations_[(station + 1) % stations_.size()], ease((into_s - kRests_s) / kMoves_s));
}

}  // namespace birdseye::hw_sim
