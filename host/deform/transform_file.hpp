#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/deform/displacement_field.hpp"

namespace birdseye::host {

/// The map from a place as it is seen now, in any frame, to where the CT at rest has it: first rigidly to the frame of
/// the CT, then p + u(p) where there is a field.
struct RestMap {
  Eigen::Matrix4d ct_from_seen = Eigen::Matrix4d::Identity();  ///< rigid, mm
  const DisplacementField* field = nullptr;

  [[nodiscard]] Eigen::Vector3d operator()(const Eigen::Vector3d& seen_mm) const;
};

/// Writes the map as an ITK transform, LPS mm. It is the transform that resampling takes, and that 3D Slicer applies to
/// the CT to bring the CT to where it is seen. path: .tfm (text) or .h5.
Result<void> write_transform(const std::filesystem::path& path, const RestMap& map);
/// Takes points through the transform in a file, by ITK. Refuses, naming the file, what is no transform.
Result<std::vector<Eigen::Vector3d>> transform_by_file(const std::filesystem::path& path,
                                                       const std::vector<Eigen::Vector3d>& points_mm);

}  // namespace birdseye::host
