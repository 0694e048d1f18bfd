#include "host/app/pose_options.hpp"

#include "host/files/field_files.hpp"

namespace birdseye::host {

void add_pose_options(CLI::App& command, PoseOptions& options) {
  command.add_option("--unit", options.unit, "of the lengths in files of poses (default: mm)")
      ->check(CLI::IsMember({"mm", "m"}));
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
  how.mm_per_unit = options.unit == "m" ? 1000 : 1;
  how.most_error_mm = options.most_error_mm;
  if (options.field.empty()) return how;
  auto map = read_field_map(options.field);
  if (!map) return map.error();
  how.field = std::move(map->map);
  return how;
}

}  // namespace birdseye::host
