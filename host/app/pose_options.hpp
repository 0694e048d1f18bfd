#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>

#include "host/files/pose_files.hpp"

namespace birdseye::host {

/// What a command is told about all its files of poses.
struct PoseOptions {
  std::string unit;  ///< empty where it is not said: mm
  std::string time_unit;
  bool column_major = false;
  std::string direction;        ///< empty where it is not said: tracker_from_sensor
  std::filesystem::path field;  ///< empty: poses are as recorded
  std::optional<double> most_error_mm;
};

/// The options that say how files of poses are to be read: what does not read such files refuses them.
inline constexpr std::initializer_list<const char*> kPoseOptions = {"--unit",      "--time-unit", "--column-major",
                                                                    "--poses-are", "--field",     "--max-error"};

/// Adds `--unit`, `--time-unit`, `--column-major` and `--poses-are`: of commands that make the map of the field
/// themselves.
void add_unit_options(CLI::App& command, PoseOptions& options);

/// Adds `--eye-time-unit`. unit must outlive the command's parsing.
void add_eye_time_unit(CLI::App& command, std::string& unit);

/// Adds `--eye-unit`, likewise.
void add_eye_unit(CLI::App& command, std::string& unit);

/// Adds these and `--field` and `--max-error`. options must outlive the command's parsing.
void add_pose_options(CLI::App& command, PoseOptions& options);

/// field: the map of `--field`, which the command has admitted; none: poses are as recorded.
PoseReading pose_reading(const PoseOptions& options, std::optional<calibration::FieldMap> field);

/// Refuses the first of these options that was given, by its name, for it would be of no effect. why: "goes with
/// --server".
Result<void> refuse_given(const CLI::App& command, std::initializer_list<const char*> options, const std::string& why);

}  // namespace birdseye::host
