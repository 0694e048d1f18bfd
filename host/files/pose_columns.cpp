#include "host/files/pose_columns.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <string_view>

namespace birdseye::host {

namespace {

using Fields = std::vector<std::string>;

constexpr std::array<std::string_view, kPoseColumns> kPoseNames{"t", "x", "y", "z", "qx", "qy", "qz", "qw"};

/// Whether a column may hold the names of pictures.
bool names_pictures(const ColumnName& name) {
  constexpr std::array<std::string_view, 9> kNames{"picture",   "image",     "file",        "filename", "picturename",
                                                   "imagename", "imagefile", "picturefile", "name"};
  const std::string joined = fmt::format("{}", fmt::join(name.words, ""));
  return std::ranges::find(kNames, joined) != kNames.end();
}

/// The columns that are angles of a turn, or a vector of one, of a header that names a position and no whole
/// quaternion.
Fields angles_in(const std::vector<std::string>& header, const PoseColumns& columns) {
  static const std::set<std::string> kAngles{
      "yaw", "pitch", "roll", "azimuth", "elevation", "heading", "rx",    "ry",   "rz",     "alpha", "beta", "gamma",
      "phi", "theta", "psi",  "rotx",    "roty",      "rotz",    "euler", "rvec", "rotvec", "az",    "el",   "angle"};
  Fields angles;
  if (columns.at[kPoseColumns - 1] || !columns.at[1] || !columns.at[2] || !columns.at[3]) return angles;
  for (std::size_t i = 0; i < header.size(); ++i) {
    const ColumnName name = column_name(header[i]);
    const bool named = std::ranges::any_of(name.words, [](const auto& word) { return kAngles.contains(word); });
    // rotation_x with no w beside it is no part of a quaternion.
    const bool part = std::find(columns.at.begin() + 4, columns.at.end(), i) != columns.at.end() &&
                      std::ranges::any_of(name.words, [](const auto& word) { return word.starts_with("rot"); });
    if (named || part) angles.push_back(header[i]);
  }
  return angles;
}

}  // namespace

PoseColumns columns_by_count(std::size_t count) {
  PoseColumns out;
  out.stacked = count == 4;
  out.matrix = out.stacked || count == 12 || count == 13 || count == 16 || count == 17;
  out.count = out.matrix || count == 7 ? count : kPoseColumns;
  if (count == 13 || count == 17) out.at[kTimeColumn] = 0;
  const std::size_t first = out.count == 7 ? 1 : 0;
  for (std::size_t c = first; c < kPoseColumns && !out.matrix; ++c) out.at[c] = c - first;
  return out;
}

Result<PoseColumns> columns_by_name(const std::vector<std::string>& header) {
  PoseColumns out;
  out.count = header.size();
  std::array<bool, kPoseColumns> exact{};
  std::vector<std::string> units;  // of lengths
  for (std::size_t i = 0; i < header.size(); ++i) {
    const ColumnName name = column_name(header[i]);
    const auto column = pose_column(name);
    if (!column && !out.picture && names_pictures(name)) out.picture = i;
    if (!column) continue;
    const auto c = static_cast<std::size_t>(*column);
    const bool ours = header[i] == kPoseNames[c];
    if (out.at[c] && c != kTimeColumn && ours == exact[c]) {
      return Error{Errc::bad_format,
                   fmt::format("its header has both {} and {} for {}: leave the columns of one pose "
                               "in, under the names {}",
                               header[*out.at[c]], header[i], kPoseNames[c], fmt::join(kPoseNames, ","))};
    }
    if (out.at[c] && !ours) continue;
    out.at[c] = i;
    exact[c] = ours;
    if (c == kTimeColumn) out.s_per = seconds_per(name.unit);
    if (c > kTimeColumn && c < 4 && !name.unit.empty()) units.push_back(name.unit);
  }
  for (const std::string& unit : units) {
    if (!mm_per(unit)) {
      return Error{
          Errc::bad_format,
          fmt::format("its header has lengths in '{}', which is no unit that is read: give mm, cm, m or inches", unit)};
    }
    if (unit != units.front() || units.size() < 3) {
      return Error{Errc::bad_format,
                   fmt::format("its header has lengths in {} alone or mixed: give x, y and z the same "
                               "unit, or none",
                               fmt::join(units, ", "))};
    }
    out.mm_per = mm_per(unit);
  }
  if (const auto angles = angles_in(header, out); !angles.empty()) {
    return Error{
        Errc::unsupported,
        fmt::format("its header has angles ({}): programs turn by them in different orders and units, and they "
                    "are not read; export quaternions (qx,qy,qz,qw), or 4x4 matrices",
                    fmt::join(angles, ", "))};
  }
  std::vector<std::string_view> lacking;
  for (std::size_t c = 1; c < kPoseColumns; ++c) {
    if (!out.at[c]) lacking.push_back(kPoseNames[c]);
  }
  if (lacking.empty()) return out;
  return Error{Errc::bad_format, fmt::format("its header lacks {}; the columns are {}", fmt::join(lacking, ", "),
                                             fmt::join(kPoseNames, ","))};
}

}  // namespace birdseye::host
