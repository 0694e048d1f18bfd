#include "host/files/body_points.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>

#include "calibration/points/point_fit.hpp"
#include "host/files/column_names.hpp"
#include "host/files/motive_header.hpp"
#include "host/files/pose_collector.hpp"
#include "host/files/rigid_body.hpp"
#include "host/files/text_rows.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using Fields = std::vector<std::string>;

/// Where in a row the coordinates of each of the body's points are.
struct PointColumns {
  std::vector<std::array<std::size_t, 3>> of_point;
  std::optional<std::size_t> time;
  std::optional<double> s_per;   ///< likewise
  std::optional<double> mm_per;  ///< as the header tells
  std::size_t count = 0;
};

/// A coordinate's column: whose it is, and which.
struct PointColumn {
  std::string point;  ///< lower case; its letters and digits
  std::size_t axis = 0;
};

/// "x1", "1_x", "P1 X [mm]", "tip.x": an axis before or behind whatever names the point.
std::optional<PointColumn> point_column(const ColumnName& name) {
  if (name.words.empty()) return std::nullopt;
  const auto axis_of = [](char c) { return std::string_view("xyz").find(c); };
  constexpr auto kNone = std::string_view::npos;
  std::string whole = fmt::format("{}", fmt::join(name.words, ""));
  const bool own_word = name.words.size() > 1;
  const auto digits = [](std::string_view text) {
    return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
  };
  const std::string_view last = name.words.back(), first = name.words.front();
  if (own_word && last.size() == 1 && axis_of(last[0]) != kNone)
    return PointColumn{whole.substr(0, whole.size() - 1), axis_of(last[0])};
  if (own_word && first.size() == 1 && axis_of(first[0]) != kNone)
    return PointColumn{whole.substr(1), axis_of(first[0])};
  if (whole.size() > 1 && axis_of(whole.front()) != kNone && digits(std::string_view(whole).substr(1)))
    return PointColumn{whole.substr(1), axis_of(whole.front())};
  if (whole.size() > 1 && axis_of(whole.back()) != kNone && whole != "index")
    return PointColumn{whole.substr(0, whole.size() - 1), axis_of(whole.back())};
  return std::nullopt;
}

std::string plain(const std::string& name) {
  return fmt::format("{}", fmt::join(column_name(name).words, ""));
}

/// The number at the end of a name, by which points without the body's names are ordered.
std::optional<int> number_at_end(const std::string& name) {
  const auto digit = name.find_last_not_of("0123456789") + 1;
  int number = 0;
  if (digit == name.size()) return std::nullopt;
  const auto [end, error] = std::from_chars(name.data() + digit, name.data() + name.size(), number);
  if (error != std::errc()) return std::nullopt;
  return number;
}

using NamedColumns = std::map<std::string, std::array<std::optional<std::size_t>, 3>>;

/// The recording's points in the order of the body's: by name, or else by the numbers in their names.
Result<std::vector<std::string>> order_of(const NamedColumns& points, const RigidBody& body) {
  std::vector<std::string> names;
  if (!body.names.empty()) {
    for (const std::string& name : body.names) {
      if (points.contains(plain(name))) names.push_back(plain(name));
    }
    if (names.size() == body.names.size()) return names;
    if (!names.empty()) {
      return Error{Errc::bad_value, fmt::format("only {} of the body's {} points are columns of it, {} among them",
                                                names.size(), body.names.size(), names.front())};
    }
  }
  std::vector<std::pair<int, std::string>> numbered;
  for (const auto& [name, columns] : points) {
    if (const auto number = number_at_end(name)) numbered.emplace_back(*number, name);
  }
  std::sort(numbered.begin(), numbered.end());
  if (numbered.size() != body.points_mm.size()) {
    return Error{Errc::bad_value, fmt::format("has columns of {} numbered points where the body has {}; name them as "
                                              "x1,y1,z1,x2,.. or as the body's file does",
                                              numbered.size(), body.points_mm.size())};
  }
  for (auto& [number, name] : numbered) names.push_back(std::move(name));
  return names;
}

Result<PointColumns> columns_by_name(const Fields& header, const RigidBody& body) {
  PointColumns out;
  out.count = header.size();
  NamedColumns points;
  for (std::size_t i = 0; i < header.size(); ++i) {
    const ColumnName name = column_name(header[i]);
    if (pose_column(name) == PoseColumn::time && !out.time) {
      out.time = i;
      out.s_per = seconds_per(name.unit);
    } else if (const auto point = point_column(name)) {
      auto& at = points[point->point].at(point->axis);
      if (at) return Error{Errc::bad_format, fmt::format("its header has the column {} twice", header[i])};
      at = i;
      if (mm_per(name.unit)) out.mm_per = mm_per(name.unit);
    }
  }
  const auto names = order_of(points, body);
  if (!names) return names.error();
  for (const std::string& name : *names) {
    const auto& at = points[name];
    if (!at[0] || !at[1] || !at[2])
      return Error{Errc::bad_format, fmt::format("its header lacks a coordinate of point {}", name)};
    out.of_point.push_back({*at[0], *at[1], *at[2]});
  }
  return out;
}

/// Columns without a header, by their count.
Result<PointColumns> columns_by_count(std::size_t count, const RigidBody& body) {
  const std::size_t points = body.points_mm.size();
  if (count != 3 * points && count != 3 * points + 1) {
    return Error{Errc::bad_format, fmt::format("{} columns where {} points of the body have {}, or {} with a time "
                                               "before them",
                                               count, points, 3 * points, 3 * points + 1)};
  }
  PointColumns out;
  out.count = count;
  const std::size_t first = count - 3 * points;
  if (first == 1) out.time = 0;
  for (std::size_t p = 0; p < points; ++p)
    out.of_point.push_back({first + 3 * p, first + 3 * p + 1, first + 3 * p + 2});
  return out;
}

/// Where the point is, or nothing: it is empty, no number, beyond what a tracker sees, or 0, 0, 0, which trackers write
/// for a point that they did not see.
std::optional<Eigen::Vector3d> seen_place(const Fields& row, const std::array<std::size_t, 3>& columns,
                                          double mm_per_unit) {
  constexpr double kFarthest_mm = 1e5;
  Eigen::Vector3d place;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const ReadNumber number = read_number(row[columns.at(axis)]);
    if (!number.problem.empty()) return std::nullopt;
    place[static_cast<int>(axis)] = mm_per_unit * number.value;
  }
  if (place.cwiseAbs().maxCoeff() > kFarthest_mm || place.isZero(0)) return std::nullopt;
  return place;
}

/// The body's pose by the points that were seen, with the error of the fit.
ReadPose pose_of_body(const RigidBody& body, const SeenPoints& seen) {
  std::vector<Eigen::Vector3d> own, places;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!seen[i]) continue;
    own.push_back(body.points_mm[i]);
    places.push_back(*seen[i]);
  }
  if (own.empty()) return {{}, "missing"};
  if (own.size() < 3)
    return {{}, fmt::format("{} of {} points were seen; a pose needs three", own.size(), seen.size())};
  const auto fit = calibration::fit_points<Tracker, Sensor>(places, own);
  if (!fit) return {{}, fmt::format("the {} points that were seen lie on a line", own.size())};
  ReadPose out{fit->to_from, {}};
  out.error_mm = fit->fre_rms_mm;
  return out;
}

class BodyTable {
 public:
  BodyTable(const fs::path& path, const PoseReading& how, RigidBody body)
      : path_(path), how_(how), body_(std::move(body)), most_mm_(how.most_error_mm.value_or(kMostBodyError_mm)) {}

  Result<void> take(TextRow row) {
    if (row.remark) return {};
    drop_empty_ends(row.fields, columns_ ? columns_->count : 1);
    if (!columns_ && begins_motive_export(row.fields)) {
      return Error{Errc::bad_value,
                   fmt::format("{}: is an export of OptiTrack Motive, which has the body's poses: leave "
                               "--{}body out, and name the rigid body by --{}tool",
                               path_.string(), how_.option_prefix, how_.option_prefix)};
    }
    if (!columns_) {
      const bool words = !row.fields[0].empty() && read_number(row.fields[0]).problem.ends_with("is no number");
      auto columns = words ? columns_by_name(row.fields, body_) : columns_by_count(row.fields.size(), body_);
      if (!columns) return columns.error().with_context(path_.string());
      columns_ = *std::move(columns);
      collector_.emplace(columns_->time.has_value(), most_mm_);
      if (words) {
        header_ = row.fields;
        return {};
      }
    }
    if (row.fields != header_) take_row(row);
    return {};
  }

  Result<PoseSet> finish(bool decimal_commas) {
    if (!collector_) return Error{Errc::bad_format, fmt::format("{}: holds no points", path_.string())};
    if (const std::string why = why_misfit(); !why.empty())
      return Error{Errc::bad_value, fmt::format("{}, {}: {}", how_.body.string(), path_.string(), why)};
    if (const auto sound = check_size(body_, how_.mm_per_unit, how_.unit_said); !sound)
      return sound.error().with_context(how_.body.string());
    if (decimal_commas) collector_->note("its numbers have decimal commas, and are read so");
    if (unmapped_ > 0) {
      collector_->note(fmt::format("{} of {} points lie where the field was not mapped, and count as not seen",
                                   unmapped_, measured_));
    }
    if (few_ > 0) collector_->note(fmt::format("{} of {} rows show fewer than three points of the body", few_, count_));
    if (!columns_->time) collector_->note("it has no times: its poses count by their order, row by row");
    auto set = std::move(*collector_).finish(path_);
    if (set) set->direction_known = true;
    return set;
  }

 private:
  void take_row(const TextRow& row) {
    const std::string name = fmt::format("line {}", row.line);
    const auto place = static_cast<double>(count_++);
    Fields fields = row.fields;
    if (fields.size() > columns_->count)
      return collector_->reject(name, fmt::format("{} columns, of {}", fields.size(), columns_->count));
    fields.resize(columns_->count);  // points at the end of a row that were not seen
    double time_s = place;
    if (columns_->time) {
      const ReadNumber time = read_number(fields[*columns_->time]);
      if (!time.problem.empty()) return collector_->reject(name, time.problem);
      time_s = columns_->s_per.value_or(how_.s_per_unit.value_or(1)) * time.value;
    }
    const SeenPoints seen = seen_in(fields);
    const ReadPose pose = pose_of_body(body_, seen);
    if (!pose.problem.empty()) ++few_;
    if (pose.error_mm) keep_for_misfit(seen, *pose.error_mm);
    collector_->add(name, time_s, time_s, pose);
  }

  /// Each point is corrected by the map of the field, where one is given; what it does not map counts as not seen.
  SeenPoints seen_in(const Fields& fields) {
    SeenPoints seen;
    for (const auto& columns : columns_->of_point) {
      auto place = seen_place(fields, columns, columns_->mm_per.value_or(how_.mm_per_unit));
      if (place && how_.field) {
        ++measured_;
        const auto correction_mm = how_.field->correction_mm(*place);
        if (!correction_mm) ++unmapped_;
        place = correction_mm ? std::optional<Eigen::Vector3d>(*place + *correction_mm) : std::nullopt;
      }
      seen.push_back(place);
    }
    return seen;
  }

  /// Of the rows that fit badly, that which shows most of the body.
  void keep_for_misfit(const SeenPoints& seen, double error_mm) {
    const auto shown = [](const SeenPoints& points) {
      return std::count_if(points.begin(), points.end(), [](const auto& p) { return p.has_value(); });
    };
    if (error_mm <= most_mm_) {
      ++fitting_;
    } else {
      ++misfitting_;
      if (misfit_.empty() || shown(seen) > shown(misfit_)) misfit_ = seen;
    }
  }

  [[nodiscard]] std::string why_misfit() const {
    return misfitting_ > fitting_ ? explain_misfit(body_, misfit_) : std::string();
  }

  const fs::path& path_;
  const PoseReading& how_;
  RigidBody body_;
  double most_mm_;
  Fields header_;
  std::optional<PointColumns> columns_;
  std::optional<PoseCollector> collector_;
  std::size_t count_ = 0, few_ = 0, fitting_ = 0, misfitting_ = 0;
  std::size_t measured_ = 0, unmapped_ = 0;  ///< points, with a map of the field
  SeenPoints misfit_;
};

}  // namespace

Result<PoseSet> read_body_poses(const fs::path& path, const PoseReading& how) {
  auto body = read_rigid_body(how.body, how.mm_per_unit);
  if (!body) return body.error();
  auto rows = TextRows::open(path);
  if (!rows) return rows.error();
  BodyTable table(path, how, *std::move(body));
  while (auto row = rows->next()) {
    if (const auto taken = table.take(*std::move(row)); !taken) return taken.error();
  }
  return table.finish(rows->decimal_commas());
}

}  // namespace birdseye::host
