#include "hw-sim/operation/hand_path.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/geometry/rotations.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr std::size_t kRemembered = 8;
constexpr double kMost_mm_s2 = 300, kMost_rad_s2 = 2;  // of a hand that is in no hurry

/// From 0 to 1 with no jerk at either end: at most 5.774 of the way per second squared, where it takes one second.
double smooth(double u) {
  u = std::clamp(u, 0.0, 1.0);
  return u * u * u * (10 + u * (6 * u - 15));
}

}  // namespace

void HandPath::rest_at(const Eigen::Vector3d& tip_in_patient_mm, double from_s) {
  const Place place{tip_in_patient_mm, moves_.empty() ? Eigen::Matrix3d::Identity().eval() : moves_.back().to.turn};
  moves_.push_back({from_s, from_s, place, place});
}

void HandPath::go_to(const Eigen::Vector3d& tip_in_patient_mm, double from_s) {
  go_to(tip_in_patient_mm, from_s, Eigen::Vector3d::Zero());
}

void HandPath::go_to(const Eigen::Vector3d& tip_in_patient_mm, double from_s, const Eigen::Vector3d& turned_rad) {
  Move move;
  move.from_s = std::max(from_s, rests_from_s());
  move.from = at(move.from_s);
  move.to = {tip_in_patient_mm, move.from.turn * rotation_exp(turned_rad)};
  move.turned_rad = turned_rad;
  const double way_mm = (move.to.tip_in_patient_mm - move.from.tip_in_patient_mm).norm();
  move.until_s = move.from_s + std::max({0.5, std::sqrt(5.774 * way_mm / kMost_mm_s2),
                                         std::sqrt(5.774 * turned_rad.norm() / kMost_rad_s2)});
  moves_.push_back(move);
  if (moves_.size() > kRemembered) moves_.pop_front();
}

HandPath::Place HandPath::at(double at_s) const {
  if (moves_.empty()) return {};
  auto move = moves_.rbegin();
  while (move + 1 != moves_.rend() && at_s < move->from_s) ++move;
  const double lasts_s = move->until_s - move->from_s;
  const double share = lasts_s > 0 ? smooth((at_s - move->from_s) / lasts_s) : 1;
  return {move->from.tip_in_patient_mm + share * (move->to.tip_in_patient_mm - move->from.tip_in_patient_mm),
          move->from.turn * rotation_exp(Eigen::Vector3d(share * move->turned_rad))};
}

}  // namespace birdseye::hw_sim
