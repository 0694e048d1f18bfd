#include "host/files/field_files.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <optional>

#include "drivers/system/whole_file.hpp"
#include "host/files/column_names.hpp"
#include "host/files/text_rows.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using Row = std::vector<std::string>;

constexpr std::string_view kNotInACell = ",;\t\n\r\"#";

std::string without(std::string_view characters, std::string text) {
  std::ranges::replace_if(
      text, [&](char c) { return characters.find(c) != std::string_view::npos; }, '-');
  return text;
}

struct TextTable {
  Row columns;
  std::vector<double> mm_per;  ///< of each column as the header names its unit; 0 where it names none
  std::vector<std::pair<std::size_t, Row>> rows;  ///< with their lines
};

/// Takes units off the names of columns, as "x [m]" has one, and gives those of other programs ours: "tx" is x.
void plain_columns(TextTable& table) {
  constexpr std::array kNames{"t", "x", "y", "z", "qx", "qy", "qz", "qw"};
  Row names;
  for (const std::string& title : table.columns) {
    const ColumnName name = column_name(title);
    const auto column = pose_column(name);
    const bool truth = !name.words.empty() && name.words.front() == "true";
    names.push_back(truth    ? fmt::format("{}", fmt::join(name.words, "_"))
                    : column ? kNames.at(static_cast<std::size_t>(*column))
                             : title);
    table.mm_per.push_back(mm_per(name.unit).value_or(0));
  }
  table.columns = std::move(names);
}

Result<TextTable> read_table(const fs::path& path, const Row& needed, bool plain = false) {
  auto rows = TextRows::open(path);
  if (!rows) return rows.error();
  TextTable table;
  while (auto row = rows->next()) {
    if (row->remark) continue;
    if (table.columns.empty()) {
      drop_empty_ends(row->fields, 1);
      table.columns = std::move(row->fields);
    } else {
      table.rows.emplace_back(row->line, std::move(row->fields));
    }
  }
  if (plain) plain_columns(table);
  for (const std::string& name : needed) {
    if (std::find(table.columns.begin(), table.columns.end(), name) == table.columns.end())
      return Error{Errc::bad_format, fmt::format("{}: has no column {}; the first line names the columns: {}",
                                                 path.string(), name, fmt::join(needed, ","))};
  }
  if (table.rows.empty()) return Error{Errc::bad_format, path.string() + ": has no rows under its first line"};
  return table;
}

/// A cell's text; empty where there is none.
std::string cell(const TextTable& table, const Row& row, const std::string& column) {
  const auto found = std::find(table.columns.begin(), table.columns.end(), column);
  const auto at = static_cast<std::size_t>(found - table.columns.begin());
  return at < row.size() ? row[at] : "";
}

constexpr double kLargest = 1e6;  // mm: beyond it stands what some trackers write for "missing", as -3.697314E28

std::optional<double> number(const std::string& text) {
  double value = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failed != std::errc() || end != text.data() + text.size() || !(std::abs(value) < kLargest)) return std::nullopt;
  return value;
}

template <std::size_t N>
std::optional<std::array<double, N>> numbers(const TextTable& table, const Row& row,
                                             const std::array<const char*, N>& columns) {
  std::array<double, N> out{};
  for (std::size_t i = 0; i < N; ++i) {
    const auto value = number(cell(table, row, columns[i]));
    if (!value) return std::nullopt;
    out[i] = *value;
  }
  return out;
}

/// Three lengths, mm.
std::optional<Eigen::Vector3d> place_mm(const TextTable& table, const Row& row,
                                        const std::array<const char*, 3>& columns, double mm_per_unit) {
  const auto values = numbers<3>(table, row, columns);
  if (!values) return std::nullopt;
  Eigen::Vector3d place;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto at = std::find(table.columns.begin(), table.columns.end(), columns.at(axis)) - table.columns.begin();
    const double told = table.mm_per.at(static_cast<std::size_t>(at));
    place[static_cast<int>(axis)] = (told > 0 ? told : mm_per_unit) * values->at(axis);
  }
  return place;
}

Result<void> all_used(const fs::path& path, std::size_t used) {
  if (used > 0) return {};
  return Error{Errc::bad_format, path.string() + ": holds no row that can be used"};
}

}  // namespace

Result<FieldSamples> read_field_grid(const fs::path& path, bool held_alike, double mm_per_unit) {
  Row needed{"true_x", "true_y", "true_z", "x", "y", "z"};
  if (held_alike) needed.insert(needed.end(), {"qx", "qy", "qz", "qw"});
  const auto table = read_table(path, needed, true);
  if (!table) return table.error();
  FieldSamples out;
  for (const auto& [line, row] : table->rows) {
    std::string name = cell(*table, row, "name");
    if (name.empty()) name = fmt::format("line {}", line);
    const auto truth_mm = place_mm(*table, row, {"true_x", "true_y", "true_z"}, 1);
    const auto measured_mm = place_mm(*table, row, {"x", "y", "z"}, mm_per_unit);
    std::optional<std::array<double, 4>> q{{0, 0, 0, 1}};
    if (held_alike) q = numbers<4>(*table, row, {"qx", "qy", "qz", "qw"});
    if (!truth_mm || !measured_mm || !q) {
      out.rejected.push_back(fmt::format("line {}: a number is missing, or is none that can be", line));
      continue;
    }
    const Eigen::Quaterniond turn((*q)[3], (*q)[0], (*q)[1], (*q)[2]);
    if (std::abs(turn.norm() - 1) > 1e-2) {
      out.rejected.push_back(fmt::format("line {}: qx,qy,qz,qw is no rotation", line));
      continue;
    }
    calibration::FieldSample sample{name, *truth_mm, {}, {turn, *measured_mm}};
    if (held_alike) sample.true_rotation = Eigen::Matrix3d::Identity();
    out.samples.push_back(std::move(sample));
  }
  if (const auto any = all_used(path, out.samples.size()); !any) return any.error();
  return out;
}

Result<GridSpec> parse_grid_spec(const std::string& text) {
  GridSpec spec;
  int taken = 0;
  auto* const c = spec.counts;
  auto* const s = spec.steps_mm;
  bool sound =
      std::sscanf(text.c_str(), "%dx%dx%d:%lfx%lfx%lfmm%n", &c[0], &c[1], &c[2], &s[0], &s[1], &s[2], &taken) == 6 &&
      taken == static_cast<int>(text.size());
  if (!sound) {
    taken = 0;
    sound = std::sscanf(text.c_str(), "%dx%dx%d:%lfmm%n", &c[0], &c[1], &c[2], &s[0], &taken) == 4 &&
            taken == static_cast<int>(text.size());
    s[1] = s[2] = s[0];
  }
  for (int axis = 0; axis < 3; ++axis)
    sound = sound && c[axis] >= 2 && c[axis] <= 100 && s[axis] > 0 && s[axis] <= 1000;
  if (sound) return spec;
  return Error{Errc::bad_value,
               fmt::format("--grid-spec {}: give counts and steps, as 6x6x5:100mm or 6x6x5:100x96x100mm", text)};
}

Result<FieldSamples> read_field_poses(const fs::path& path, const GridSpec& spec, bool held_alike,
                                      const PoseReading& how) {
  auto poses = read_pose_set(path, how);
  if (!poses) return poses.error();
  const auto& n = spec.counts;
  const std::size_t nodes = static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1] * n[2]);
  if (poses->poses.size() + poses->rejected.size() != nodes)
    return Error{Errc::bad_value,
                 fmt::format("{}: {} poses for {} nodes; give a pose for each node, in their order, and an INVALID or "
                             "NaN one for a node that was left out",
                             path.string(), poses->poses.size() + poses->rejected.size(), nodes)};
  FieldSamples out{{}, std::move(poses->rejected)};
  for (const TimedPose& pose : poses->poses) {
    const auto at = static_cast<int>(pose.index);
    const int i = at % n[0], j = at / n[0] % n[1], k = at / n[0] / n[1];
    const Eigen::Vector3d place(i * spec.steps_mm[0], j * spec.steps_mm[1], k * spec.steps_mm[2]);
    calibration::FieldSample sample{
        fmt::format("node {},{},{} ({})", i + 1, j + 1, k + 1, pose.name), place, {}, pose.tracker_from_sensor};
    if (held_alike) sample.true_rotation = Eigen::Matrix3d::Identity();
    out.samples.push_back(std::move(sample));
  }
  return out;
}

Result<FieldPairs> read_field_pairs(const PoseFile& a, const PoseFile& b) {
  constexpr double kSameMomentS = 0.005;
  auto of_a = read_pose_set(a.path, a.how), of_b = read_pose_set(b.path, b.how);
  if (!of_a) return of_a.error();
  if (!of_b) return of_b.error();
  FieldPairs out;
  for (const auto& [path, set] : {std::pair{&a.path, &*of_a}, std::pair{&b.path, &*of_b}}) {
    for (const std::string& why : set->rejected) out.rejected.push_back(path->filename().string() + ": " + why);
  }
  const bool timed = of_a->timed && of_b->timed;
  std::size_t k = 0;
  for (const TimedPose& pose : of_a->poses) {
    const auto before = [&](const TimedPose& other) {
      return timed ? other.time_s < pose.time_s - kSameMomentS : other.index < pose.index;
    };
    while (k < of_b->poses.size() && before(of_b->poses[k])) ++k;
    if (k == of_b->poses.size()) break;
    const TimedPose& other = of_b->poses[k];
    if (timed ? other.time_s > pose.time_s + kSameMomentS : other.index != pose.index) continue;
    out.pairs.push_back({pose.name, pose.tracker_from_sensor, other.tracker_from_sensor});
    ++k;
  }
  if (out.pairs.empty())
    return Error{Errc::bad_value, fmt::format("{} and {}: no two poses are of the same moment (to 5 ms); were they "
                                              "recorded together, on one clock?",
                                              a.path.string(), b.path.string())};
  return out;
}

Result<calibration::FieldMapFile> read_field_map(const fs::path& path) {
  const auto text = read_whole_file(path, kMostTextBytes);
  if (!text) return Error{text.error().code, text.error().what + "; give a map of the field"};
  auto map = calibration::parse_field_map(*text);
  if (!map) return map.error().with_context(path.string());
  return map;
}

Result<AdmittedField> read_field_map(const fs::path& path, const Authors& authors) {
  if (path.empty()) return AdmittedField();
  auto read = read_field_map(path);
  if (!read) return read.error();
  auto doubt = authors.admit(calibration::kFieldMapFormat, read->sha256, read->signature);
  if (!doubt)
    return Error{doubt.error().code, fmt::format("{}: the map of the field {}", path.string(), doubt.error().what)};
  return AdmittedField{std::move(read->map), *std::move(doubt)};
}

CorrectedPlaces corrected_places(const calibration::FieldMap& map, std::span<const Eigen::Vector3d> measured_mm) {
  CorrectedPlaces out;
  for (std::size_t i = 0; i < measured_mm.size(); ++i) {
    if (const auto correction_mm = map.correction_mm(measured_mm[i])) {
      out.places_mm.push_back(measured_mm[i] + *correction_mm);
    } else {
      out.unmapped.push_back(fmt::format("point {}: {}", i + 1, map.why_not(measured_mm[i])));
    }
  }
  return out;
}

Result<std::vector<std::pair<std::string, Eigen::Vector3d>>> read_places(const fs::path& path) {
  const auto table = read_table(path, {"name", "x", "y", "z"}, true);
  if (!table) return table.error();
  std::vector<std::pair<std::string, Eigen::Vector3d>> out;
  for (const auto& [line, row] : table->rows) {
    const auto place = place_mm(*table, row, {"x", "y", "z"}, 1);
    if (!place)
      return Error{Errc::bad_format,
                   fmt::format("{}:{}: needs a name and three numbers, mm; measure it again, or take it out",
                               path.string(), line)};
    out.emplace_back(cell(*table, row, "name"), *place);
  }
  return out;
}

Result<std::vector<calibration::FieldCheck>> read_history(const fs::path& path) {
  std::vector<calibration::FieldCheck> out;
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return out;
  const auto table = read_table(path, {"when", "rms_mm", "scale_percent", "worst_mm", "worst_place"});
  if (!table) return table.error();
  for (const auto& [line, row] : table->rows) {
    const auto v = numbers<3>(*table, row, {"rms_mm", "scale_percent", "worst_mm"});
    if (!v)
      return Error{Errc::bad_format,
                   fmt::format("{}:{}: is no day of a history; take the line out", path.string(), line)};
    out.push_back({cell(*table, row, "when"), (*v)[0], (*v)[1], (*v)[2], cell(*table, row, "worst_place"), {}});
  }
  return out;
}

std::string day_name(std::string when) {
  return without(" ", without(kNotInACell, std::move(when)));
}

std::string history_text(const std::vector<calibration::FieldCheck>& history) {
  std::string out = "when,rms_mm,scale_percent,worst_mm,worst_place\n";
  for (const auto& day : history) {
    out += fmt::format("{},{:.4f},{:.4f},{:.4f},{}\n", day_name(day.when), day.rms_mm, day.scale_percent, day.worst_mm,
                       without(kNotInACell, day.worst_place));
  }
  return out;
}

}  // namespace birdseye::host
