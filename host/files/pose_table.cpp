#include "host/files/pose_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "calibration/base/lower_case.hpp"
#include "calibration/base/median.hpp"
#include "host/files/column_names.hpp"
#include "host/files/motive_header.hpp"
#include "host/files/pose_collector.hpp"
#include "host/files/pose_columns.hpp"
#include "host/files/text_rows.hpp"
#include "host/files/tool_column.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using Fields = std::vector<std::string>;

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
    if (columns_->stacked && row.fields.size() == 4)
      take_matrix_row(row);
    else
      take_pose(row);
    return {};
  }

  /// first: the first row of an export of OptiTrack's Motive; rows is read on to the end of its header.
  Result<void> take_motive_header(const Fields& first, TextRows& rows) {
    const auto header = read_motive_header(first, rows, how_);
    if (!header) return Error{header.error().code, fmt::format("{}: {}", path_.string(), header.error().what)};
    if (auto started = start(header->columns); !started) return started;
    of_motive_ = true;
    collector_->note(
        fmt::format("it is an export of OptiTrack Motive: the poses of its rigid body {} are read", header->body));
    return {};
  }

  Result<PoseSet> finish(bool decimal_commas) {
    if (!stack_.empty()) {
      return Error{Errc::bad_format,
                   fmt::format("{}: holds {} rows of four numbers, which are no 4x4 matrices one below another: each "
                               "has four rows, the last 0 0 0 1; or write each matrix in one row, of 16 numbers",
                               path_.string(), 4 * count_ + stack_.size() / 4)};
    }
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
    if (set && of_motive_) set->direction_known = true;
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

  /// A row of four numbers of a matrix that has four such rows.
  void take_matrix_row(const TextRow& row) {
    stack_.insert(stack_.end(), row.fields.begin(), row.fields.end());
    if (stack_.size() < 16) return;
    const auto place = static_cast<double>(count_++);
    ReadPose pose = corrected(matrix_of_row(stack_, how_.mm_per_unit), how_);
    if (pose.problem == kNoLastRow || pose.problem == kNoRotation)
      pose.problem +=
          " (rows of four numbers are read as matrices one below another, of four rows each, 0 0 0 1 below three)";
    collector_->add(fmt::format("the matrix up to line {}", row.line), place, place, pose);
    stack_.clear();
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
                                     header_.empty() && !of_motive_
                                         ? "; without a header all rows have 7 or 8, or 4, 12, 13, 16 or 17 of a matrix"
                                         : ""));
    }
    double time_s = place;
    if (columns_->timed()) {
      const ReadNumber time = read_number(fields[*columns_->at[kTimeColumn]]);
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
    ReadPose out =
        checked_pose(Eigen::Quaterniond(v[7], v[4], v[5], v[6]), Eigen::Vector3d(v[1], v[2], v[3]), mm_per_unit);
    if (!columns_->error) return out;
    const ReadNumber error = read_number(fields[*columns_->error]);
    if (error.problem.empty()) out.error_mm = mm_per_unit * error.value;
    return out;
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
  Fields stack_;  ///< numbers of a matrix of which all four rows are not read yet
  double s_per_ = 1;
  std::vector<double> times_s_;
  std::size_t count_ = 0, repeated_headers_ = 0, of_others_ = 0;
  bool of_motive_ = false;
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
  auto rows = TextRows::open(path);
  if (!rows) return rows.error();
  auto row = rows->next();
  const bool motive = row && begins_motive_export(row->fields);
  Result<std::optional<Chosen>> chosen = std::optional<Chosen>();
  if (!motive) chosen = choose_tool(path, how);
  if (!chosen) return chosen.error();
  PoseTable table(path, how, *std::move(chosen));
  if (motive) {
    if (const auto taken = table.take_motive_header(row->fields, *rows); !taken) return taken.error();
    row = rows->next();
  }
  for (; row; row = rows->next()) {
    if (const auto taken = table.take(*std::move(row)); !taken) return taken.error();
  }
  return table.finish(rows->decimal_commas());
}

}  // namespace birdseye::host
