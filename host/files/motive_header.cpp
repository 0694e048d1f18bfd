#include "host/files/motive_header.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>

#include "calibration/base/lower_case.hpp"

namespace birdseye::host {

namespace {

using Fields = std::vector<std::string>;

/// More lines than any version of Motive writes before the first frame.
constexpr std::size_t kMostLines = 20;

/// What stands behind this word in the first line: names and values in turn.
std::string value_behind(const Fields& first_row, std::string_view word) {
  for (std::size_t i = 0; i + 1 < first_row.size(); ++i) {
    if (lower_case(first_row[i]) == word) return lower_case(first_row[i + 1]);
  }
  return {};
}

/// The lines between the first and the frames.
struct Lines {
  Fields type, name, quantity, axis;
};

std::string_view cell_of(const Fields& row, std::size_t at) {
  return at < row.size() ? std::string_view(row[at]) : std::string_view();
}

Result<Lines> read_lines(TextRows& rows) {
  Lines out;
  Fields before;
  for (std::size_t n = 0; n < kMostLines; ++n) {
    const auto row = rows.next();
    if (!row) break;
    const std::string first = lower_case(cell_of(row->fields, 0)), label = lower_case(cell_of(row->fields, 1));
    if (first == "frame" && label.starts_with("time")) {
      out.quantity = before;
      out.axis = row->fields;
      return out;
    }
    if (label == "type") out.type = row->fields;
    if (label == "name") out.name = row->fields;
    before = row->fields;
  }
  return Error{Errc::bad_format,
               "is an export of OptiTrack Motive without the line of columns, \"Frame,Time\": export "
               "it as CSV with its header"};
}

/// The names of the rigid bodies, each once.
Fields bodies_of(const Lines& lines) {
  Fields out;
  for (std::size_t i = 0; i < lines.axis.size(); ++i) {
    if (lower_case(cell_of(lines.type, i)) != "rigid body") continue;
    const std::string name(cell_of(lines.name, i));
    if (std::ranges::find(out, name) == out.end()) out.push_back(name);
  }
  return out;
}

Result<std::string> choose_body(const Fields& bodies, const PoseReading& how) {
  if (bodies.empty()) {
    return Error{Errc::bad_format,
                 "is an export of OptiTrack Motive without any rigid body: make one of the markers in "
                 "Motive, and export with rigid bodies"};
  }
  const std::string held =
      fmt::format("it is an export of OptiTrack Motive, with the rigid bodies {}", fmt::join(bodies, ", "));
  if (how.transform.empty() && bodies.size() == 1) return bodies.front();
  if (how.transform.empty()) {
    return Error{Errc::bad_value,
                 fmt::format("say whose poses are meant by --{}tool NAME; {}", how.option_prefix, held)};
  }
  const auto found = std::ranges::find_if(
      bodies, [&how](const std::string& name) { return lower_case(name) == lower_case(how.transform); });
  if (found != bodies.end()) return *found;
  return Error{Errc::bad_value, fmt::format("has no tool {}; {}", how.transform, held)};
}

/// Which of PoseColumn a column of a rigid body is.
std::optional<PoseColumn> column_of(const std::string& quantity, const std::string& axis) {
  const auto at = std::string_view("xyzw").find(axis);
  if (axis.size() != 1 || at == std::string_view::npos) return std::nullopt;
  if (quantity == "rotation") return static_cast<PoseColumn>(static_cast<std::size_t>(PoseColumn::qx) + at);
  if (quantity == "position" && at < 3) return static_cast<PoseColumn>(static_cast<std::size_t>(PoseColumn::x) + at);
  return std::nullopt;
}

/// How many mm the unit is that the first line names, as "Meters".
Result<double> unit_of(const Fields& first_row, const PoseReading& how) {
  const std::string name = value_behind(first_row, "length units");
  if (name == "meters") return 1000;
  if (name == "centimeters") return 10;
  if (name == "millimeters") return 1;
  if (name.empty() && how.unit_said) return how.mm_per_unit;
  return Error{Errc::bad_format,
               name.empty() ? std::string("is an export of OptiTrack Motive that names no unit of its lengths: say it, "
                                          "--unit m where Motive was not told otherwise")
                            : fmt::format("is an export of OptiTrack Motive with lengths in \"{}\", which are not "
                                          "read: export it in meters",
                                          name)};
}

}  // namespace

bool begins_motive_export(const Fields& first_row) {
  return lower_case(cell_of(first_row, 0)) == "format version" && first_row.size() > 2;
}

Result<MotiveHeader> read_motive_header(const Fields& first_row, TextRows& rows, const PoseReading& how) {
  const std::string turns = value_behind(first_row, "rotation type"),
                    space = value_behind(first_row, "coordinate space");
  if (!turns.empty() && turns != "quaternion") {
    return Error{Errc::unsupported,
                 fmt::format("is an export of OptiTrack Motive with angles ({}), which are not read: export it with "
                             "Rotation Type Quaternion",
                             turns)};
  }
  if (!space.empty() && space != "global") {
    return Error{Errc::unsupported, fmt::format("is an export of OptiTrack Motive with poses in another body's frame "
                                                "(Coordinate Space {}): export it with Coordinate Space Global",
                                                space)};
  }
  const auto lines = read_lines(rows);
  if (!lines) return lines.error();
  auto body = choose_body(bodies_of(*lines), how);
  if (!body) return body.error();
  const auto mm_per_unit = unit_of(first_row, how);
  if (!mm_per_unit) return mm_per_unit.error();
  MotiveHeader out;
  out.body = *std::move(body);
  out.columns.count = lines->axis.size();
  out.columns.mm_per = *mm_per_unit;
  out.columns.s_per = 1;
  out.columns.at[static_cast<std::size_t>(PoseColumn::time)] = 1;
  for (std::size_t i = 2; i < lines->axis.size(); ++i) {
    if (lower_case(cell_of(lines->type, i)) != "rigid body" || cell_of(lines->name, i) != out.body) continue;
    const std::string quantity = lower_case(cell_of(lines->quantity, i));
    if (quantity.find("error") != std::string::npos) out.columns.error = i;
    const auto column = column_of(quantity, lower_case(cell_of(lines->axis, i)));
    if (!column) continue;
    auto& at = out.columns.at.at(static_cast<std::size_t>(*column));
    if (at) {
      return Error{Errc::bad_format, fmt::format("is an export of OptiTrack Motive with two rigid bodies called {}: "
                                                 "rename one in Motive and export again",
                                                 out.body)};
    }
    at = i;
  }
  if (std::ranges::all_of(out.columns.at, [](const auto& at) { return at.has_value(); })) return out;
  return Error{Errc::bad_format,
               fmt::format("is an export of OptiTrack Motive whose rigid body {} has no whole pose: export it with "
                           "Rotation Type Quaternion, X, Y, Z, W, and Position",
                           out.body)};
}

}  // namespace birdseye::host
