#pragma once

#include <string>
#include <vector>

#include "host/files/pose_columns.hpp"
#include "host/files/pose_files.hpp"
#include "host/files/text_rows.hpp"

namespace birdseye::host {

/// Whether a table that begins with this row is an export of OptiTrack's Motive.
bool begins_motive_export(const std::vector<std::string>& first_row);

/// Of an export of Motive: whose columns are read, and what each holds.
struct MotiveHeader {
  PoseColumns columns;
  std::string body;  ///< the rigid body's name
};

/// Reads rows up to and with the last one of the header, of which first_row was the first. Refuses what has no rigid
/// body, or several of which how names none, angles in place of quaternions, poses in a parent's frame, and lengths
/// whose unit is not known.
Result<MotiveHeader> read_motive_header(const std::vector<std::string>& first_row, TextRows& rows,
                                        const PoseReading& how);

}  // namespace birdseye::host
