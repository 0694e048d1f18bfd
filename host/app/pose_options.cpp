#include "host/app/pose_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "host/files/column_names.hpp"

namespace birdseye::host {

namespace {

using Units = std::vector<std::string>;

const Units kUnitsOfLength{"mm", "cm", "m", "in"};
const Units kUnitsOfTime{"s", "ms", "us", "ns"};

/// Takes one of the units; of others the error says of what they are the unit. of_what: "of the lengths in files of
/// poses".
CLI::Validator one_of(const Units& units, const std::string& of_what) {
  const auto check = [units, of_what](const std::string& given) -> std::string {
    if (std::ranges::find(units, given) != units.end()) return {};
    return fmt::format("\"{}\" is no unit that is read {}: say {} or {}", given, of_what,
                       fmt::join(units.begin(), units.end() - 1, ", "), units.back());
  };
  return {check, fmt::format("{{{}}}", fmt::join(units, ","))};
}

}  // namespace

void add_unit_options(CLI::App& command, PoseOptions& options) {
  command.add_option("--unit", options.unit, "of the lengths in files of poses: mm (default), cm, m or in")
      ->check(one_of(kUnitsOfLength, "of the lengths in files of poses"));
  command.add_option("--time-unit", options.time_unit, "of the times in tables of poses whose header names no unit")
      ->check(one_of(kUnitsOfTime, "of the times in tables of poses"));
  command.add_flag("--column-major", options.column_major,
                   "matrices in files of poses are written column by column, as OpenGL's and MATLAB's");
  command
      .add_option("--poses-are", options.direction,
                  "what the tracker's poses are: tracker_from_sensor, where the sensor is in the tracker's frame "
                  "(default), or its inverse sensor_from_tracker")
      ->check(CLI::IsMember({"tracker_from_sensor", "sensor_from_tracker"}));
}

void add_eye_time_unit(CLI::App& command, std::string& unit) {
  command.add_option("--eye-time-unit", unit, "the same as --time-unit, of --eye-poses alone")
      ->check(one_of(kUnitsOfTime, "of the times in --eye-poses"));
}

void add_eye_unit(CLI::App& command, std::string& unit) {
  command.add_option("--eye-unit", unit, "the same as --unit, of --eye-poses alone: the camera's poses")
      ->check(one_of(kUnitsOfLength, "of the lengths in --eye-poses, the camera's poses"));
}

void add_pose_options(CLI::App& command, PoseOptions& options) {
  add_unit_options(command, options);
  command
      .add_option("--field", options.field,
                  "correct tracked poses by this map of the tracker's field (birdseye calibrate field)")
      ->type_name("MAP");
  command
      .add_option("--max-error", options.most_error_mm,
                  "leave out poses whose file (an NDI log), or whose fit (of --body), tells a larger error, mm")
      ->check(CLI::Range(0.001, 1000.0));
}

PoseReading pose_reading(const PoseOptions& options, std::optional<calibration::FieldMap> field) {
  PoseReading how;
  how.mm_per_unit = mm_per(options.unit).value_or(1);
  how.unit_said = !options.unit.empty();
  how.s_per_unit = seconds_per(options.time_unit);
  how.column_major = options.column_major;
  how.inverted = options.direction == "sensor_from_tracker";
  how.most_error_mm = options.most_error_mm;
  how.field = std::move(field);
  return how;
}

Result<void> refuse_given(const CLI::App& command, std::initializer_list<const char*> options, const std::string& why) {
  for (const char* option : options) {
    if (command.count(option) > 0) return Error{Errc::bad_value, fmt::format("{} {}: leave it out", option, why)};
  }
  return {};
}

}  // namespace birdseye::host
