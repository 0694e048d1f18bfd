#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace birdseye::host {

/// The name of a table's column, as "p_RS_R_x [m]", taken apart.
struct ColumnName {
  std::vector<std::string> words;  ///< lower case, without the unit: p, rs, r, x
  std::string unit;                ///< lower case: m; empty where none is told
};
ColumnName column_name(std::string_view text);

/// How many mm, or how many seconds, one of the unit is; none for what is no such unit.
std::optional<double> mm_per(std::string_view unit);
std::optional<double> seconds_per(std::string_view unit);
/// The unit's plain name, for messages: "inches", "microseconds".
std::string name_of_mm(double mm_per_unit);
std::string name_of_seconds(double s_per_unit);

/// What a column of a table of poses holds.
enum class PoseColumn : std::size_t { time, x, y, z, qx, qy, qz, qw };
inline constexpr std::size_t kPoseColumns = 8;

/// By the names that programs give: t, time, timestamp; x, tx, px, pos_x, "position.x"; qx, quaternion_x,
/// orientation.w, q0 to q3 (w, x, y, z); none where the name tells none of these.
std::optional<PoseColumn> pose_column(const ColumnName& name);

}  // namespace birdseye::host
