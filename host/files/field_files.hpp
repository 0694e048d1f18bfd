#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/field/field_check.hpp"
#include "calibration/field/field_fit.hpp"
#include "calibration/field/field_pairs.hpp"
#include "calibration/record/field_map_file.hpp"
#include "host/files/authors.hpp"
#include "host/files/pose_files.hpp"

namespace birdseye::host {

/// Samples that were read, and lines that were passed over with the reason: "line 8: not finite".
struct FieldSamples {
  std::vector<calibration::FieldSample> samples;
  std::vector<std::string> rejected;
};

/// A table with the columns true_x, true_y, true_z, x, y, z and, if orientation was measured, qx, qy, qz, qw
/// (Hamilton); a column name is taken for names. Lengths are in the unit that a column's header names, as "x [m]"; else
/// true places in mm, and what the tracker said in units of mm_per_unit. held_alike: the sensor was turned the same way
/// at each place.
Result<FieldSamples> read_field_grid(const std::filesystem::path& path, bool held_alike, double mm_per_unit = 1);

/// Nodes of a regular grid: counts along each axis, x fastest, and steps between them.
struct GridSpec {
  int counts[3] = {0, 0, 0};
  double steps_mm[3] = {0, 0, 0};
};
/// "6x6x5:100mm", or "6x6x5:100x96x100mm" where the steps differ.
Result<GridSpec> parse_grid_spec(const std::string& text);
/// Reads a file of poses, one for each node of the grid in order. A rejected pose counts as a node that was left out.
Result<FieldSamples> read_field_poses(const std::filesystem::path& path, const GridSpec& spec, bool held_alike,
                                      const PoseReading& how = {});

struct FieldPairs {
  std::vector<calibration::FieldPair> pairs;
  std::vector<std::string> rejected;
};
/// A file of poses, and how it is to be read.
struct PoseFile {
  std::filesystem::path path;
  PoseReading how = {};
};
/// Two files of poses, paired by their times (to 5 ms), or by their order where they have none.
Result<FieldPairs> read_field_pairs(const PoseFile& a, const PoseFile& b);

/// Reads a field map that `birdseye calibrate field` wrote; an error names the file.
Result<calibration::FieldMapFile> read_field_map(const std::filesystem::path& path);

struct AdmittedField {
  std::optional<calibration::FieldMap> map;
  std::string doubt;  ///< empty where the author is known, as of Authors::admit()
};
/// The same as far as Authors::admit() lets it pass. Of an empty path, no map.
Result<AdmittedField> read_field_map(const std::filesystem::path& path, const Authors& authors);

/// Places in the tracker's frame as a map corrects them, in their order, and why others could not be: "point 3: at ..".
struct CorrectedPlaces {
  std::vector<Eigen::Vector3d> places_mm;
  std::vector<std::string> unmapped;
};
CorrectedPlaces corrected_places(const calibration::FieldMap& map, std::span<const Eigen::Vector3d> measured_mm);

/// Reads a table name,x,y,z: a plate's places, true or touched; in mm, or in the unit that the header names.
Result<std::vector<std::pair<std::string, Eigen::Vector3d>>> read_places(const std::filesystem::path& path);

/// Reads the days of a history; empty where there is no such file yet.
Result<std::vector<calibration::FieldCheck>> read_history(const std::filesystem::path& path);
/// The name of a day as a history writes it: without what would make columns of it.
std::string day_name(std::string when);
std::string history_text(const std::vector<calibration::FieldCheck>& history);

}  // namespace birdseye::host
