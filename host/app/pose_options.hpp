#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>

#include "host/files/pose_files.hpp"

namespace birdseye::host {

/// What a command is told about all its files of poses.
struct PoseOptions {
  std::string unit = "mm";
  std::filesystem::path field;  ///< empty: poses are as recorded
  std::optional<double> most_error_mm;
};

/// Adds `--unit`, `--field` and `--max-error`. options must outlive the command's parsing.
void add_pose_options(CLI::App& command, PoseOptions& options);

/// Refuses a map of the field that cannot be read.
Result<PoseReading> pose_reading(const PoseOptions& options);

}  // namespace birdseye::host
