#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "hw-sim/case/draw.hpp"
#include "hw-sim/case/subject.hpp"

namespace birdseye::hw_sim {

/// What truth.json tells of a deformation: one number or several, mm and degrees where the name says nothing else.
struct DrawnNumber {
  std::string name;
  std::vector<double> values;
};

/// A deformation drawn but for its size. The move is that of the tissue at a place at rest, smooth and nearly
/// proportional to the size, which is about how far the organ moves where it moves most.
struct DrawnMove {
  std::function<Eigen::Vector3d(const Eigen::Vector3d& rest_mm, double size_mm)> move_mm;
  std::vector<DrawnNumber> numbers;
};

/// The organ is bent into an arc, about an axis drawn across its length.
DrawnMove bend(const OrganShape& organ, Draw& draw);
/// An instrument dents the side that the scope sees, so wide at half the dent's depth; deep inside nothing moves.
DrawnMove push(const OrganShape& organ, double width_mm, Draw& draw);
/// Pressed together along a drawn axis, and spread across it so that each piece keeps its volume.
DrawnMove compression(const OrganShape& organ, Draw& draw);
/// Turned about a drawn axis, the more the further along it.
DrawnMove twist(const OrganShape& organ, Draw& draw);
/// The diaphragm comes down towards the feet, and the upper end with it more than the lower.
DrawnMove breathing(const OrganShape& organ, Draw& draw);
/// Gas presses the front back and flattens it; the sides spread.
DrawnMove pneumoperitoneum(const OrganShape& organ, Draw& draw);

}  // namespace birdseye::hw_sim
