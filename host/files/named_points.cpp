#include "host/files/named_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
#include <set>
#include <string_view>

#include "calibration/base/lower_case.hpp"
#include "calibration/geometry/rigid_matrix.hpp"
#include "host/files/column_names.hpp"
#include "host/files/point_sets.hpp"
#include "host/files/pose_collector.hpp"
#include "host/files/text_rows.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using Fields = std::vector<std::string>;

constexpr std::string_view kLineOfAPoint =
    "give x y z in mm on each line, a name before or behind them if it has one, or name the columns in a first line: "
    "name,x,y,z";

/// Where a table's numbers and names stand.
struct Columns {
  std::array<std::size_t, 3> axes{};
  std::optional<std::size_t> name;
  double mm_per_unit = 1;
  StatedFrame frame = StatedFrame::none;
};

bool is_number(std::string_view field) {
  return read_number(field).problem.empty();
}

bool is_not_finite(std::string_view field) {
  return read_number(field).problem == "not finite";
}

/// x, y or z as 0 to 2, and the frame that the letter tells: r, a, s and l, p, s.
struct Axis {
  std::size_t index = 0;
  StatedFrame frame = StatedFrame::none;
};
std::optional<Axis> axis_of(const ColumnName& name, bool ras) {
  if (const auto column = pose_column(name)) {
    if (*column < PoseColumn::x || *column > PoseColumn::z) return std::nullopt;
    return Axis{static_cast<std::size_t>(*column) - static_cast<std::size_t>(PoseColumn::x)};
  }
  if (name.words.size() != 1 || name.words[0].size() != 1) return std::nullopt;
  const auto at = std::string_view(ras ? "ras" : "lps").find(name.words[0]);
  if (at == std::string_view::npos) return std::nullopt;
  return Axis{at, ras ? StatedFrame::ras : StatedFrame::lps};
}

/// How much the name of a column tells that it holds the points' names: 0 for not at all.
int rank_as_name(const ColumnName& name) {
  constexpr std::array<std::string_view, 7> kFromLeast{"id", "no", "point", "landmark", "marker", "name", "label"};
  const std::string last = name.words.empty() ? "" : name.words.back();
  const auto found = std::find(kFromLeast.begin(), kFromLeast.end(), last == "fiducial" ? "marker" : last);
  return found == kFromLeast.end() ? 0 : static_cast<int>(found - kFromLeast.begin()) + 1;
}

/// By the names of the columns. An error tells what is wrong with them.
Result<Columns> columns_of(const Fields& header) {
  std::vector<ColumnName> names;
  names.reserve(header.size());
  for (const std::string& field : header) names.push_back(column_name(field));
  const bool ras = std::any_of(names.begin(), names.end(), [](const ColumnName& name) {
    return name.words.size() == 1 && (name.words[0] == "r" || name.words[0] == "a");
  });
  Columns out;
  std::array<int, 3> found{};
  std::set<std::string> units;
  int rank = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (const auto axis = axis_of(names[i], ras)) {
      out.axes[axis->index] = i;
      if (axis->frame != StatedFrame::none) out.frame = axis->frame;
      ++found[axis->index];
      units.insert(names[i].unit);
    } else if (const int here = rank_as_name(names[i]); here > rank) {
      rank = here;
      out.name = i;
    }
  }
  if (found != std::array<int, 3>{1, 1, 1}) {
    return Error{Errc::bad_format,
                 fmt::format("the columns x, y and z are not named there, each once; {}", kLineOfAPoint)};
  }
  const std::string unit = units.size() == 1 ? *units.begin() : "";
  const auto scale = unit.empty() ? std::optional<double>(1) : mm_per(unit);
  if (units.size() > 1 || !scale) {
    return Error{Errc::bad_format, "the columns x, y and z are not all in mm, or in one other unit of length: give mm"};
  }
  out.mm_per_unit = *scale;
  return out;
}

/// A row that is numbers with decimal commas, separated by blanks, as "12,5 -3,0 7,25": it was taken apart at commas.
Fields parted_at_blanks(const Fields& fields) {
  const auto blank = [](const std::string& field) { return field.find(' ') != std::string::npos; };
  if (std::none_of(fields.begin(), fields.end(), blank)) return fields;
  std::string line;
  for (const std::string& field : fields) line += (line.empty() ? "" : ",") + field;
  Fields parted(1);
  for (const char c : line) {
    if (c != ' ' && c != '\t') {
      parted.back() += c;
    } else if (!parted.back().empty()) {
      parted.emplace_back();
    }
  }
  for (std::string& field : parted) {
    std::string pointed = field;
    std::replace(pointed.begin(), pointed.end(), ',', '.');
    if (is_number(pointed)) field = pointed;
  }
  return parted;
}

/// A point of a table whose columns are not named: three numbers in a row, words before or behind them.
Result<StatedPoint> point_of_words(Fields fields) {
  const auto numbers = [](const Fields& row) { return std::count_if(row.begin(), row.end(), is_number); };
  if (numbers(fields) != 3) fields = parted_at_blanks(fields);
  const auto first = std::find_if(fields.begin(), fields.end(), is_number);
  const auto after = std::find_if_not(first, fields.end(), is_number);
  if (numbers(fields) != 3 || after - first != 3) {
    const auto infinite = std::find_if(fields.begin(), fields.end(), is_not_finite);
    if (infinite != fields.end())
      return Error{Errc::bad_format, fmt::format("\"{}\" is not finite; {}", *infinite, kLineOfAPoint)};
    return Error{Errc::bad_format,
                 fmt::format("{} numbers where a point has three; {}", numbers(fields), kLineOfAPoint)};
  }
  StatedPoint out;
  for (int axis = 0; axis < 3; ++axis) out.place_mm[axis] = read_number(*(first + axis)).value;
  for (auto field = fields.begin(); field != fields.end(); ++field) {
    if (field >= first && field < after) continue;
    out.name += (out.name.empty() || field->empty() ? "" : " ") + *field;
  }
  return out;
}

Result<StatedPoint> point_of_columns(const Columns& columns, const Fields& fields) {
  StatedPoint out;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t at = columns.axes[axis];
    const ReadNumber number = read_number(at < fields.size() ? fields[at] : "");
    if (!number.problem.empty()) {
      return Error{Errc::bad_format, fmt::format("{} is {}; give x, y and z of each point, or take its line out",
                                                 "xyz"[axis], number.problem)};
    }
    out.place_mm[static_cast<Eigen::Index>(axis)] = columns.mm_per_unit * number.value;
  }
  if (columns.name && *columns.name < fields.size()) out.name = fields[*columns.name];
  return out;
}

/// A line that counts the point before its three numbers, as "1 253.5 -38.5 -1109.6".
bool is_counted(const Fields& fields) {
  const auto digits = [](const std::string& field) {
    return !field.empty() && std::ranges::all_of(field, [](char c) { return c >= '0' && c <= '9'; });
  };
  return fields.size() == 4 && std::ranges::all_of(fields, is_number) && digits(fields[0]) &&
         !(digits(fields[1]) && digits(fields[2]) && digits(fields[3]));
}

/// The part of a remark behind "key =".
std::optional<std::string> value_of(const std::string& remark, std::string_view key) {
  const auto equals = remark.find('=');
  if (equals == std::string::npos || lower_case(trimmed(remark.substr(0, equals))) != key) return std::nullopt;
  return std::string(trimmed(remark.substr(equals + 1)));
}

/// Text tables and 3D Slicer's .fcsv, whose remarks name its frame and its columns.
class TableOfPoints {
 public:
  Result<void> take(TextRow row) {
    if (row.remark) return take_remark(std::move(row.fields));
    const auto remark =
        std::find_if(row.fields.begin(), row.fields.end(), [](const auto& field) { return field.starts_with('#'); });
    row.fields.erase(remark, row.fields.end());
    if (row.fields.empty()) return {};
    const bool first = out_.points.empty() && !columns_;
    if (first && row.fields.size() > 2 && std::none_of(row.fields.begin(), row.fields.end(), is_number) &&
        std::none_of(row.fields.begin(), row.fields.end(), is_not_finite)) {
      auto columns = columns_of(row.fields);
      if (!columns) return columns.error();
      columns_ = *std::move(columns);
      return columns_->frame != StatedFrame::none ? state(columns_->frame) : Result<void>();
    }
    if (first) counted_ = is_counted(row.fields);
    std::string count;
    if (!columns_ && counted_) {
      if (!is_counted(row.fields) || !counts_.insert(row.fields[0]).second)
        return Error{Errc::bad_format,
                     fmt::format("the lines begin with a number that counts the points, and here is none, or one that "
                                 "stood before; {}",
                                 kLineOfAPoint)};
      count = row.fields[0];
      row.fields.erase(row.fields.begin());
    }
    auto point = columns_ ? point_of_columns(*columns_, row.fields) : point_of_words(std::move(row.fields));
    if (!point) return point.error();
    if (!count.empty()) point->name = count;
    out_.points.push_back(*std::move(point));
    return {};
  }

  [[nodiscard]] bool is_fcsv_without_frame() const { return fcsv_ && out_.frame == StatedFrame::none; }
  [[nodiscard]] StatedPoints finish() && { return std::move(out_); }

 private:
  Result<void> state(StatedFrame frame) {
    if (out_.frame != StatedFrame::none && out_.frame != frame) {
      return Error{Errc::bad_format,
                   "the CoordinateSystem, or the columns l p s or r a s, say both LPS and RAS; take out what is wrong"};
    }
    out_.frame = frame;
    return {};
  }

  Result<void> take_remark(Fields fields) {
    if (fields.empty()) return {};
    std::string line;
    for (const std::string& field : fields) line += (line.empty() ? "" : " ") + field;
    fcsv_ = fcsv_ || lower_case(line).starts_with("markups fiducial file");
    if (const auto frame = value_of(line, "coordinatesystem")) {
      const StatedFrame stated = frame_of_word(*frame);
      if (stated != StatedFrame::none) return state(stated);
      return Error{Errc::bad_format,
                   fmt::format("CoordinateSystem is \"{}\": save the points in LPS or RAS", frame->substr(0, 40))};
    }
    const auto columns = value_of(fields[0], "columns");
    if (!columns) return {};
    fields[0] = *columns;
    auto named = columns_of(fields);
    if (!named) return named.error();
    columns_ = *std::move(named);
    return {};
  }

  StatedPoints out_;
  std::optional<Columns> columns_;
  bool fcsv_ = false;
  bool counted_ = false;
  std::set<std::string> counts_;
};

/// By its first bytes.
bool is_text(const fs::path& path) {
  std::string first(512, ' ');
  std::ifstream(path, std::ios::binary).read(first.data(), static_cast<std::streamsize>(first.size()));
  return std::none_of(first.begin(), first.end(),
                      [](char c) { return c >= 0 && c < ' ' && c != '\t' && c != '\r' && c != '\n'; });
}

Result<StatedPoints> read_table(const fs::path& path) {
  auto rows = TextRows::open(path);
  if (!rows) return rows.error();
  if (!is_text(path)) {
    return Error{Errc::bad_format, fmt::format("{}: is no text; save the points as text (CSV), 3D Slicer's .mrk.json "
                                               "or .fcsv, or MITK's .mps",
                                               path.string())};
  }
  TableOfPoints table;
  while (auto row = rows->next()) {
    const std::size_t line = row->line;
    if (const auto taken = table.take(*std::move(row)); !taken)
      return taken.error().with_context(fmt::format("{}: line {}", path.string(), line));
  }
  if (table.is_fcsv_without_frame()) {
    return Error{Errc::bad_format,
                 fmt::format("{}: does not say whether its points are in LPS or RAS; put a line \"# CoordinateSystem = "
                             "LPS\" or \"# CoordinateSystem = RAS\" before them",
                             path.string())};
  }
  return std::move(table).finish();
}

/// 3D Slicer takes a tracker's poses as they are into the frame that it shows, which it calls RAS.
void turn(StatedPoints& stated, PointsOf of, const fs::path& path) {
  const StatedFrame wanted = of == PointsOf::patient ? StatedFrame::lps : StatedFrame::ras;
  if (stated.frame == StatedFrame::none) return;
  if (of == PointsOf::tracker) {
    stated.notes.push_back(
        fmt::format("{}: 3D Slicer's RAS is taken for the tracker's frame: right where Slicer shows the tracker's "
                    "poses as they come",
                    path.string()));
  }
  if (stated.frame == wanted) return;
  for (StatedPoint& point : stated.points) point.place_mm.head<2>() *= -1;
  if (of == PointsOf::patient) {
    stated.notes.push_back(
        fmt::format("{}: its points are in RAS, and are turned to LPS: x and y have the other sign", path.string()));
  }
}

}  // namespace

Result<NamedPoints> read_named_points(const fs::path& path, PointsOf of) {
  const std::string extension = lower_case(path.extension().string());
  auto stated = extension == ".json"  ? read_slicer_markups(path)
                : extension == ".mps" ? read_mitk_points(path)
                                      : read_table(path);
  if (!stated) return stated.error();
  if (stated->points.empty()) return Error{Errc::bad_format, fmt::format("{}: holds no points", path.string())};
  if (of == PointsOf::sensor && stated->frame != StatedFrame::none) {
    return Error{Errc::bad_format, fmt::format("{}: its points are the patient's (LPS or RAS) where one of a sensor's "
                                               "frame is asked for; give a text with a line x y z, mm",
                                               path.string())};
  }
  for (const StatedPoint& point : stated->points) {
    if (const double most_mm = point.place_mm.cwiseAbs().maxCoeff(); !(most_mm <= kFarthestMm)) {
      return Error{Errc::bad_value, fmt::format("{}: a point is {:.6g} mm away, further than {:.0f} m: give the points "
                                                "in mm",
                                                path.string(), most_mm, kFarthestMm / 1000)};
    }
  }
  if (extension != ".mps") turn(*stated, of, path);
  NamedPoints out;
  out.notes = std::move(stated->notes);
  std::set<std::string> names;
  for (StatedPoint& point : stated->points) {
    out.places_mm.push_back(point.place_mm);
    if (!point.name.empty()) names.insert(point.name);
    out.names.push_back(std::move(point.name));
  }
  if (names.size() < out.places_mm.size()) {
    const auto twice = std::ranges::find_if(
        out.names, [&](const std::string& name) { return !name.empty() && std::ranges::count(out.names, name) > 1; });
    if (twice != out.names.end()) {
      out.notes.push_back(
          fmt::format("{}: \"{}\" is the name of more than one point: its names are not used", path.string(), *twice));
    }
    out.names.clear();
  }
  return out;
}

Result<std::vector<Eigen::Vector3d>> read_points(const fs::path& path, PointsOf of) {
  auto read = read_named_points(path, of);
  if (!read) return read.error();
  return std::move(read->places_mm);
}

}  // namespace birdseye::host
