#include "host/files/pose_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "calibration/base/lower_case.hpp"
#include "calibration/base/median.hpp"
#include "host/files/column_names.hpp"
#include "host/files/pose_collector.hpp"
#include "host/files/text_rows.hpp"
#include "host/files/tool_column.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using Fields = std::vector<std::string>;

constexpr std::array<std::string_view, kPoseColumns> kPoseNames{"t", "x", "y", "z", "qx", "qy", "qz", "qw"};
constexpr auto kTime = static_cast<std::size_t>(PoseColumn::time);

/// The unit of a time whose header names none, s. What is too large for seconds since 1970 is counted in smaller units.
double seconds_per_unit_of(double time) {
  constexpr double kLeastMilliseconds = 1e11, kLeastMicroseconds = 1e14, kLeastNanoseconds = 1e16;
  if (time > kLeastNanoseconds) return 1e-9;
  if (time > kLeastMicroseconds) return 1e-6;
  return time > kLeastMilliseconds ? 1e-3 : 1;
}

/// Times so far apart are not in seconds: no tracker measures, and nobody takes stations, so seldom.
constexpr double kLongestStepS = 600;
constexpr std::size_t kFewestSteps = 20;

/// Where in a row each of PoseColumn is, and what its numbers are.
struct PoseColumns {
  std::array<std::optional<std::size_t>, kPoseColumns> at;
  std::size_t count = 0;         ///< of all columns of a row
  std::optional<double> mm_per;  ///< as the header tells
  std::optional<double> s_per;
  std::optional<std::size_t> picture;  ///< the name of the one that was taken there
  bool matrix = false;                 ///< rows are 4x4 or 3x4 matrices, after a time, and nothing else
  [[nodiscard]] bool timed() const { return at[kTime].has_value(); }
};

/// Columns of a table without a header, by their count.
PoseColumns columns_by_count(std::size_t count) {
  PoseColumns out;
  out.matrix = count == 12 || count == 13 || count == 16 || count == 17;
  out.count = out.matrix || count == 7 ? count : kPoseColumns;
  if (count == 13 || count == 17) out.at[kTime] = 0;
  const std::size_t first = out.count == 7 ? 1 : 0;
  for (std::size_t c = first; c < kPoseColumns && !out.matrix; ++c) out.at[c] = c - first;
  return out;
}

/// Whether a column may hold the names of pictures.
bool names_pictures(const ColumnName& name) {
  constexpr std::array<std::string_view, 9> kNames{"picture",   "image",     "file",        "filename", "picturename",
                                                   "imagename", "imagefile", "picturefile", "name"};
  const std::string joined = fmt::format("{}", fmt::join(name.words, ""));
  return std::ranges::find(kNames, joined) != kNames.end();
}

/// The columns that are angles of a turn, or a vector of one, of a header that names a position and no whole
/// quaternion.
Fields angles_in(const Fields& header, const PoseColumns& columns) {
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

/// What each column of a header is. A name that is exactly ours goes before others that mean the same.
Result<PoseColumns> columns_by_name(const Fields& header) {
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
    if (out.at[c] && c != kTime && ours == exact[c]) {
      return Error{Errc::bad_format,
                   fmt::format("its header has both {} and {} for {}: leave the columns of one pose "
                               "in, under the names {}",
                               header[*out.at[c]], header[i], kPoseNames[c], fmt::join(kPoseNames, ","))};
    }
    if (out.at[c] && !ours) continue;
    out.at[c] = i;
    exact[c] = ours;
    if (c == kTime) out.s_per = seconds_per(name.unit);
    if (c > kTime && c < 4 && !name.unit.empty()) units.push_back(name.unit);
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

bool is_words(const Fields& row) {
  return !row.empty() && !row[0].empty() && read_number(row[0]).problem.ends_with("is no number");
}

/// Whose rows are read, of a table with a column that says whose each is.
struct Chosen {
  std::size_t at = 0;  ///< of the column
  std::string tool;
};

/// The numbers of a matrix, with its last row 0 0 0 1 where it is left out.
std::string with_last_row(Fields numbers, bool by_columns) {
  for (std::size_t i = 0; numbers.size() < 16 && i < 4; ++i)
    numbers.insert(by_columns ? numbers.begin() + static_cast<std::ptrdiff_t>(4 * i + 3) : numbers.end(),
                   i < 3 ? "0" : "1");
  return fmt::format("{}", fmt::join(numbers, " "));
}

class PoseTable {
 public:
  PoseTable(const fs::path& path, const PoseReading& how, std::optional<Chosen> chosen)
      : path_(path), how_(how), chosen_(std::move(chosen)) {}

  Result<void> take(TextRow row) {
    if (row.remark) return take_remark(row);
    drop_empty_ends(row.fields, columns_ ? columns_->count : 1);
    if (!columns_ && is_words(row.fields)) return take_header(row);
    if (chosen_ && chosen_->at < row.fields.size() && row.fields[chosen_->at] != chosen_->tool &&
        row.fields != header_) {
      ++of_others_;
      return {};
    }
    if (row.fields == header_) {
      ++repeated_headers_;
      return {};
    }
    if (!columns_) {
      if (auto started = start(columns_by_count(row.fields.size())); !started) return started;
    }
    take_pose(row);
    return {};
  }

  Result<PoseSet> finish(bool decimal_commas) {
    if (!collector_) return Error{Errc::bad_format, fmt::format("{}: holds no poses", path_.string())};
    if (decimal_commas) collector_->note("its numbers have decimal commas, and are read so");
    if (repeated_headers_ > 0)
      collector_->note(fmt::format("its header comes again in {} later {}, passed over", repeated_headers_,
                                   repeated_headers_ == 1 ? "line" : "lines"));
    if (const auto sound = check_steps(); !sound) return sound.error();
    if (columns_->timed() && s_per_ != 1 && !how_.s_per_unit)
      collector_->note(fmt::format("its times are read as {}", name_of_seconds(s_per_)));
    if (columns_->mm_per && columns_->mm_per != how_.mm_per_unit)
      collector_->note(fmt::format("its lengths are in {}, as its header says", name_of_mm(*columns_->mm_per)));
    if (of_others_ > 0)
      collector_->note(
          fmt::format("the poses of {} are read; {} other rows name another tool, or none", chosen_->tool, of_others_));
    if (!columns_->timed() && !columns_->picture)
      collector_->note("it has no times: its poses count by their order, row by row");
    auto set = std::move(*collector_).finish(path_);
    if (set && columns_->picture) set->picture_column = header_[*columns_->picture];
    return set;
  }

 private:
  /// A remark may be the header, as "# timestamp tx ty tz qx qy qz qw".
  Result<void> take_remark(const TextRow& row) {
    if (columns_) return {};
    auto columns = columns_by_name(row.fields);
    if (!columns && columns.error().code == Errc::unsupported) return columns.error().with_context(path_.string());
    if (!columns) return {};
    header_ = row.fields;
    return start(*columns);
  }

  Result<void> take_header(const TextRow& row) {
    auto columns = columns_by_name(row.fields);
    if (!columns) return columns.error().with_context(path_.string());
    header_ = row.fields;
    return start(*columns);
  }

  Result<void> start(const PoseColumns& columns) {
    if (how_.column_major && !columns.matrix) {
      return Error{Errc::bad_value, fmt::format("{}: --column-major goes with matrices: leave it out", path_.string())};
    }
    columns_ = columns;
    collector_.emplace(columns.timed(), how_.most_error_mm);
    s_per_ = columns.s_per.value_or(how_.s_per_unit.value_or(1));
    return {};
  }

  void take_pose(const TextRow& row) {
    const std::string name = fmt::format("line {}", row.line);
    const Fields& fields = row.fields;
    const auto place = static_cast<double>(count_++);
    if (fields.size() != columns_->count) {
      const std::string problem = read_number(fields[fields.size() > 1 ? 1 : 0]).problem;
      const bool absent = fields.size() <= 2 && (problem == "missing" || problem == "INVALID");
      return collector_->reject(
          name, absent ? problem
                       : fmt::format("{} numbers where a row has {}{}", fields.size(), columns_->count,
                                     header_.empty()
                                         ? "; without a header all rows have 7 or 8, or 12, 13, 16 or 17 of a matrix"
                                         : ""));
    }
    double time_s = place;
    if (columns_->timed()) {
      const ReadNumber time = read_number(fields[*columns_->at[kTime]]);
      if (!time.problem.empty()) return collector_->reject(name, time.problem);
      if (!columns_->s_per && !how_.s_per_unit) s_per_ = std::min(s_per_, seconds_per_unit_of(time.value));
      time_s = s_per_ * time.value;
      times_s_.push_back(time_s);
    }
    collector_->add(name, time_s, time_s, corrected(pose_of_row(fields), how_),
                    columns_->picture ? fields[*columns_->picture] : std::string());
  }

  /// Microseconds that nobody says to be such would pass for hours.
  [[nodiscard]] Result<void> check_steps() const {
    if (columns_->s_per || how_.s_per_unit || times_s_.size() < kFewestSteps) return {};
    std::vector<double> steps_s;
    steps_s.reserve(times_s_.size());
    for (std::size_t i = 1; i < times_s_.size(); ++i) steps_s.push_back(std::abs(times_s_[i] - times_s_[i - 1]));
    const double step_s = median_of(std::move(steps_s));
    if (step_s <= kLongestStepS) return {};
    return Error{
        Errc::bad_value,
        fmt::format("{}: its times, read as seconds, are {:g} s apart, which no tracker's are: say their unit, "
                    "--time-unit ms, us or ns, or name it in the header, as t [us]",
                    path_.string(), step_s)};
  }

  [[nodiscard]] ReadPose pose_of_row(const Fields& fields) const {
    const double mm_per_unit = columns_->mm_per.value_or(how_.mm_per_unit);
    if (columns_->matrix)
      return matrix_of_row({fields.begin() + (columns_->timed() ? 1 : 0), fields.end()}, mm_per_unit);
    std::array<double, kPoseColumns> v{};
    for (std::size_t c = 1; c < kPoseColumns; ++c) {
      const ReadNumber number = read_number(fields[*columns_->at[c]]);
      if (!number.problem.empty()) return {{}, number.problem};
      v[c] = number.value;
    }
    return checked_pose(Eigen::Quaterniond(v[7], v[4], v[5], v[6]), Eigen::Vector3d(v[1], v[2], v[3]), mm_per_unit);
  }

  [[nodiscard]] ReadPose matrix_of_row(const Fields& numbers, double mm_per_unit) const {
    const bool by_columns = how_.column_major;
    ReadPose out = read_matrix(with_last_row(numbers, by_columns), mm_per_unit, by_columns);
    if (!out.problem.empty() &&
        read_matrix(with_last_row(numbers, !by_columns), mm_per_unit, !by_columns).problem.empty())
      out.problem = written_other_way(by_columns);
    return out;
  }

  const fs::path& path_;
  const PoseReading& how_;
  Fields header_;
  std::optional<PoseColumns> columns_;
  std::optional<PoseCollector> collector_;
  std::optional<Chosen> chosen_;
  double s_per_ = 1;
  std::vector<double> times_s_;
  std::size_t count_ = 0, repeated_headers_ = 0, of_others_ = 0;
};

/// The column that says whose the rows are, where the table has a header with one.
Result<std::optional<ToolColumn>> tool_column_of(const fs::path& path) {
  auto rows = TextRows::open(path);
  if (!rows) return rows.error();
  std::optional<ToolColumnSearch> search;
  Fields header;
  while (auto row = rows->next()) {
    drop_empty_ends(row->fields, header.empty() ? 1 : header.size());
    if (search) {
      if (!row->remark && row->fields != header) search->take(row->fields);
      continue;
    }
    if (row->remark && !columns_by_name(row->fields)) continue;
    if (!row->remark && !is_words(row->fields)) break;
    header = row->fields;
    search.emplace(header);
    if (!search->possible()) break;
  }
  return search ? search->found() : std::optional<ToolColumn>();
}

/// Whose rows are to be read: the tool that is asked for, or the only one. None where no column says whose they are.
Result<std::optional<Chosen>> choose_tool(const fs::path& path, const PoseReading& how) {
  const auto column = tool_column_of(path);
  if (!column) return column.error();
  const std::string& wanted = how.transform;
  if (!*column) {
    if (wanted.empty()) return std::optional<Chosen>();
    return Error{
        Errc::bad_value,
        fmt::format("{}: --{}tool {} (or --transform): no column of this table says whose pose a row is: leave the "
                    "option out if all rows are of one tool",
                    path.string(), how.option_prefix, wanted)};
  }
  const auto& names = (*column)->rows;
  if (wanted.empty() && names.size() == 1) return std::optional<Chosen>(Chosen{(*column)->at, names.begin()->first});
  const auto found = std::find_if(names.begin(), names.end(), [&](const auto& name) {
    return name.first == wanted || lower_case(name.first) == lower_case(wanted);
  });
  if (!wanted.empty() && found != names.end()) return std::optional<Chosen>(Chosen{(*column)->at, found->first});
  const std::string held = fmt::format("its column \"{}\" names {}", (*column)->title, (*column)->names());
  if (wanted.empty()) {
    return Error{Errc::bad_value, fmt::format("{}: say whose poses are meant by --{}tool NAME; {}", path.string(),
                                              how.option_prefix, held)};
  }
  return Error{Errc::bad_value, fmt::format("{}: has no tool {}; {}", path.string(), wanted, held)};
}

}  // namespace

Result<PoseSet> read_pose_table(const fs::path& path, const PoseReading& how) {
  auto chosen = choose_tool(path, how);
  if (!chosen) return chosen.error();
  auto rows = TextRows::open(path);
  if (!rows) return rows.error();
  PoseTable table(path, how, *std::move(chosen));
  while (auto row = rows->next()) {
    if (const auto taken = table.take(*std::move(row)); !taken) return taken.error();
  }
  return table.finish(rows->decimal_commas());
}

}  // namespace birdseye::host
