#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "calibration/base/result.hpp"

namespace birdseye::hw_sim {

nlohmann::json json_of(const Eigen::Vector3d& v);
nlohmann::json json_of(const Eigen::Matrix4d& m);  ///< row by row

Result<void> write_text(const std::filesystem::path& path, const std::string& text);
/// Indented, with a final newline.
Result<void> write_json(const std::filesystem::path& path, const nlohmann::json& json);

}  // namespace birdseye::hw_sim
