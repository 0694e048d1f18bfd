#include "host/case/point_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <sstream>
#include <string_view>

#include "drivers/system/whole_file.hpp"
#include "host/files/pose_collector.hpp"

namespace birdseye::host {

namespace {

constexpr std::string_view kSurfaceHeader = "x_mm,y_mm,z_mm,sigma_mm";
constexpr std::string_view kMatchedHeader = "x_mm,y_mm,z_mm,sigma_mm,rest_x_mm,rest_y_mm,rest_z_mm";
constexpr std::size_t kSurfaceFields = 4, kMatchedFields = 7, kMostRows = 300;

/// What stands between the commas, without the blanks about it.
std::vector<std::string> fields_of(std::string line) {
  line += ',';  // getline leaves out an empty last one
  std::vector<std::string> out;
  std::istringstream in(line);
  for (std::string field; std::getline(in, field, ',');) out.emplace_back(trimmed(field));
  return out;
}

std::optional<double> number_of(const std::string& field) {
  double value = 0;
  const char* const end = field.data() + field.size();
  const auto [stop, error] = std::from_chars(field.data(), end, value);
  if (error != std::errc() || stop != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// The numbers of a row: four, or all seven.
Result<std::vector<double>> numbers_of(std::vector<std::string> fields, std::size_t columns) {
  if (fields.size() != columns)
    return Error{Errc::bad_format, fmt::format("{} fields where the first line names {}", fields.size(), columns)};
  const bool no_rest =
      std::all_of(fields.begin() + kSurfaceFields, fields.end(), [](const auto& one) { return one.empty(); });
  if (no_rest) fields.resize(kSurfaceFields);
  std::vector<double> out;
  for (const std::string& field : fields) {
    const auto number = number_of(field);
    if (!number) return Error{Errc::bad_format, fmt::format("'{}' is not a number", field)};
    out.push_back(*number);
  }
  if (!(out[3] >= kLeastGivenSigma_mm && out[3] <= kMostGivenSigma_mm)) {
    return Error{Errc::bad_value, fmt::format("sigma_mm is {:g}; give one from {} to {}", out[3], kLeastGivenSigma_mm,
                                              kMostGivenSigma_mm)};
  }
  return out;
}

}  // namespace

Result<PointRows> read_point_rows(const std::filesystem::path& path) {
  const auto text = read_whole_file(path, kMostTextBytes);
  if (!text) return text.error();
  std::istringstream in(*text);
  std::string line;
  if (!std::getline(in, line)) return Error{Errc::unreadable, fmt::format("{}: is empty", path.string())};
  const std::vector<std::string> header = fields_of(line);
  if (header != fields_of(std::string(kSurfaceHeader)) && header != fields_of(std::string(kMatchedHeader))) {
    return Error{Errc::bad_format,
                 fmt::format("{}: the first line is neither {} nor {}", path.string(), kSurfaceHeader, kMatchedHeader)};
  }
  PointRows out;
  for (int number = 2; std::getline(in, line); ++number) {
    std::vector<std::string> fields = fields_of(line);
    if (fields == std::vector<std::string>{""}) continue;
    const std::string where = fmt::format("{}: line {}", path.string(), number);
    if (out.surface.size() + out.matched.size() == kMostRows) {
      return Error{Errc::bad_value, fmt::format("{}: the file has more than {} places; leave in those farthest apart",
                                                where, kMostRows)};
    }
    const auto row = numbers_of(std::move(fields), header.size());
    if (!row) return row.error().with_context(where);
    const Eigen::Vector3d place((*row)[0], (*row)[1], (*row)[2]);
    const double sigma_mm = (*row)[3];
    if (row->size() < kMatchedFields) {
      out.surface.push_back({place, sigma_mm, std::nullopt});
      continue;
    }
    out.matched.push_back(
        {fmt::format("{} line {}", path.filename().string(), number),
         0,
         {Eigen::Vector3d((*row)[4], (*row)[5], (*row)[6]), place, sigma_mm * sigma_mm * Eigen::Matrix3d::Identity()}});
  }
  if (out.surface.empty() && out.matched.empty())
    return Error{Errc::bad_format, fmt::format("{}: holds no places; leave [points] out", path.string())};
  return out;
}

}  // namespace birdseye::host
