#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// A rigid body by its points, in a frame of its own.
struct RigidBody {
  std::vector<Eigen::Vector3d> points_mm;
  std::vector<std::string> names;  ///< as many, or none
};

/// Reads x y z a line, with a name before them or none, under a header or none. Refuses fewer than three points, a
/// point that is not finite, names for some points only, and one name twice.
Result<RigidBody> read_rigid_body(const std::filesystem::path& path, double mm_per_unit);

/// Refuses a body of a size that none has, and names the units in which it would have one. unit_said: mm_per_unit was
/// said by somebody, who may have a very small body.
Result<void> check_size(const RigidBody& body, double mm_per_unit, bool unit_said);

/// Where the body's points were seen; none for those that were not.
using SeenPoints = std::vector<std::optional<Eigen::Vector3d>>;

/// What makes a body's points fit where they fit badly as they stand, in words: another order, a mirror, another size.
/// Empty where nothing of that does. Orders are tried for bodies of up to nine points.
std::string explain_misfit(const RigidBody& body, const SeenPoints& seen);

}  // namespace birdseye::host
