#include "host/files/pose_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "calibration/base/units.hpp"
#include "host/files/column_names.hpp"
#include "host/files/pose_collector.hpp"
#include "host/files/text_rows.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using Fields = std::vector<std::string>;

constexpr std::array<std::string_view, kPoseColumns> kPoseNames{"t", "x", "y", "z", "qx", "qy", "qz", "qw"};
constexpr auto kTime = static_cast<std::size_t>(PoseColumn::time);
/// A time beyond this cannot be seconds: it is nanoseconds since 1970.
constexpr double kLeastNanoseconds = 1e16;

/// Where in a row each of PoseColumn is, and what its numbers are.
struct PoseColumns {
  std::array<std::optional<std::size_t>, kPoseColumns> at;
  std::size_t count = 0;         ///< of all columns of a row
  std::optional<double> mm_per;  ///< as the header tells
  std::optional<double> s_per;
  bool matrix = false;  ///< rows are 4x4 or 3x4 matrices, row by row, and nothing else
  [[nodiscard]] bool timed() const { return at[kTime].has_value(); }
};

/// Columns of a table without a header, by their count.
PoseColumns columns_by_count(std::size_t count) {
  PoseColumns out;
  out.matrix = count == 12 || count == 16;
  out.count = out.matrix || count == 7 ? count : kPoseColumns;
  const std::size_t first = out.count == 7 ? 1 : 0;
  for (std::size_t c = first; c < kPoseColumns && !out.matrix; ++c) out.at[c] = c - first;
  return out;
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

class PoseTable {
 public:
  PoseTable(const fs::path& path, const PoseReading& how) : path_(path), how_(how) {}

  Result<void> take(TextRow row) {
    if (row.remark) return take_remark(row);
    drop_empty_ends(row.fields, columns_ ? columns_->count : 1);
    if (!columns_ && is_words(row.fields)) return take_header(row);
    if (row.fields == header_) {
      ++repeated_headers_;
      return {};
    }
    if (!columns_) start(columns_by_count(row.fields.size()));
    take_pose(row);
    return {};
  }

  Result<PoseSet> finish(bool decimal_commas) {
    if (!collector_) return Error{Errc::bad_format, fmt::format("{}: holds no poses", path_.string())};
    if (decimal_commas) collector_->note("its numbers have decimal commas, and are read so");
    if (repeated_headers_ > 0)
      collector_->note(
          fmt::format("its header comes again in {} later lines, which are passed over", repeated_headers_));
    if (columns_->timed() && s_per_ != 1) collector_->note(fmt::format("its times are in units of {:g} s", s_per_));
    if (columns_->mm_per && columns_->mm_per != how_.mm_per_unit)
      collector_->note(fmt::format("its header says that lengths are in units of {:g} mm", *columns_->mm_per));
    if (!columns_->timed()) collector_->note("it has no times: its poses count by their order, row by row");
    return std::move(*collector_).finish(path_);
  }

 private:
  /// A remark may be the header, as "# timestamp tx ty tz qx qy qz qw".
  Result<void> take_remark(const TextRow& row) {
    if (columns_) return {};
    if (auto columns = columns_by_name(row.fields)) {
      header_ = row.fields;
      start(*columns);
    }
    return {};
  }

  Result<void> take_header(const TextRow& row) {
    auto columns = columns_by_name(row.fields);
    if (!columns) return columns.error().with_context(path_.string());
    header_ = row.fields;
    start(*columns);
    return {};
  }

  void start(const PoseColumns& columns) {
    columns_ = columns;
    collector_.emplace(columns.timed(), how_.most_error_mm);
    s_per_ = columns.s_per.value_or(1);
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
                                     header_.empty() ? "; without a header all rows have 7, 8, 12 or 16" : ""));
    }
    double time_s = place;
    if (columns_->timed()) {
      const ReadNumber time = read_number(fields[*columns_->at[kTime]]);
      if (!time.problem.empty()) return collector_->reject(name, time.problem);
      if (!columns_->s_per && time.value > kLeastNanoseconds) s_per_ = 1 / kNsPerSecond;
      time_s = s_per_ * time.value;
    }
    collector_->add(name, time_s, time_s, corrected(pose_of_row(fields), how_.field));
  }

  [[nodiscard]] ReadPose pose_of_row(const Fields& fields) const {
    const double mm_per_unit = columns_->mm_per.value_or(how_.mm_per_unit);
    if (columns_->matrix)
      return read_matrix(fmt::format("{}{}", fmt::join(fields, " "), columns_->count == 12 ? " 0 0 0 1" : ""),
                         mm_per_unit);
    std::array<double, kPoseColumns> v{};
    for (std::size_t c = 1; c < kPoseColumns; ++c) {
      const ReadNumber number = read_number(fields[*columns_->at[c]]);
      if (!number.problem.empty()) return {{}, number.problem};
      v[c] = number.value;
    }
    return checked_pose(Eigen::Quaterniond(v[7], v[4], v[5], v[6]), Eigen::Vector3d(v[1], v[2], v[3]), mm_per_unit);
  }

  const fs::path& path_;
  const PoseReading& how_;
  Fields header_;
  std::optional<PoseColumns> columns_;
  std::optional<PoseCollector> collector_;
  double s_per_ = 1;
  std::size_t count_ = 0, repeated_headers_ = 0;
};

}  // namespace

Result<PoseSet> read_pose_table(const fs::path& path, const PoseReading& how) {
  auto rows = TextRows::open(path);
  if (!rows) return rows.error();
  PoseTable table(path, how);
  while (auto row = rows->next()) {
    if (const auto taken = table.take(*std::move(row)); !taken) return taken.error();
  }
  return table.finish(rows->decimal_commas());
}

}  // namespace birdseye::host
