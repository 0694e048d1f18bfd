#include "host/app/pose_options.hpp"

#include <fmt/format.h>

#include "host/files/column_names.hpp"
#include "host/files/field_files.hpp"

namespace birdseye::host {

void add_unit_options(CLI::App& command, PoseOptions& options) {
  command.add_option("--unit", options.unit, "of the lengths in files of poses: mm (default), cm, m or in")
      ->check(CLI::IsMember({"mm", "cm", "m", "in"}));
  command.add_option("--time-unit", options.time_unit, "of the times in tables of poses whose header names no unit")
      ->check(CLI::IsMember({"s", "ms", "us", "ns"}));
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
      ->check(CLI::IsMember({"s", "ms", "us", "ns"}));
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

Result<PoseReading> pose_reading(const PoseOptions& options) {
  PoseReading how;
  how.mm_per_unit = mm_per(options.unit).value_or(1);
  how.s_per_unit = seconds_per(options.time_unit);
  how.column_major = options.column_major;
  how.inverted = options.direction == "sensor_from_tracker";
  how.most_error_mm = options.most_error_mm;
  if (options.field.empty()) return how;
  auto map = read_field_map(options.field);
  if (!map) return map.error();
  how.field = std::move(map->map);
  return how;
}

Result<void> refuse_given(const CLI::App& command, std::initializer_list<const char*> options, const std::string& why) {
  for (const char* option : options) {
    if (command.count(option) > 0) return Error{Errc::bad_value, fmt::format("{} {}: leave it out", option, why)};
  }
  return {};
}

}  // namespace birdseye::host
