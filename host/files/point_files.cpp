#include "host/files/point_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "drivers/system/whole_file.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using calibration::PatternView;

constexpr const char* kImagePoints = "image_points";

/// Rows of so many numbers.
Result<std::vector<std::vector<double>>> read_rows(const fs::path& path, std::size_t columns) {
  const auto text = read_whole_file(path, kMostTextBytes);
  if (!text && text.error().code == Errc::unsupported)
    return Error{Errc::bad_format, path.string() + ": is larger than any list of points"};
  if (!text)
    return Error{Errc::unreadable, path.string() + ": cannot be read; a view needs ids, object and image points"};
  std::istringstream file(*text);
  std::vector<std::vector<double>> rows;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    std::istringstream words(line);
    std::vector<double> row;
    for (std::string word; words >> word;) {
      char* end = nullptr;
      row.push_back(std::strtod(word.c_str(), &end));  // takes nan and inf, which the solver names
      if (*end != '\0')
        return Error{Errc::bad_format, fmt::format("{}:{}: '{}' is not a number", path.string(), number, word)};
    }
    if (row.empty()) continue;
    if (row.size() != columns) {
      return Error{Errc::bad_format,
                   fmt::format("{}:{}: {} numbers, of {}", path.string(), number, row.size(), columns)};
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

/// N of "image_points.N.txt", or -1 where there is none.
int number_of(const std::string& name) {
  const std::size_t at = name.find(kImagePoints) + std::string(kImagePoints).size();
  const std::string rest = name.substr(std::min(at, name.size()));
  int number = -1;
  const std::size_t digit = rest.find_first_of("0123456789");
  if (digit != std::string::npos) std::from_chars(rest.data() + digit, rest.data() + rest.size(), number);
  return number;
}

Result<PatternView> read_view(const fs::path& image_points) {
  const std::string name = image_points.filename().string();
  const auto beside = [&](const char* what) {
    std::string other = name;
    other.replace(other.find(kImagePoints), std::string(kImagePoints).size(), what);
    return image_points.parent_path() / other;
  };
  const auto pixels = read_rows(image_points, 2);
  if (!pixels) return pixels.error();
  const auto points = read_rows(beside("object_points"), 3);
  if (!points) return points.error();
  const auto ids = read_rows(beside("ids"), 1);
  if (!ids) return ids.error();
  if (points->size() != pixels->size() || ids->size() != pixels->size()) {
    return Error{Errc::bad_format, fmt::format("{}: {} points of the picture, {} of the board, {} ids",
                                               image_points.string(), pixels->size(), points->size(), ids->size())};
  }
  PatternView view;
  view.name = name;
  for (std::size_t i = 0; i < ids->size(); ++i) {
    const double id = (*ids)[i][0];
    if (!(std::abs(id) < 1e9) || id != std::floor(id))
      return Error{Errc::bad_format, fmt::format("{}: '{}' is no number of a point", beside("ids").string(), id)};
    view.ids.push_back(static_cast<int>(id));
    view.points_in_marker_mm.emplace_back((*points)[i][0], (*points)[i][1], (*points)[i][2]);
    view.points_px.emplace_back((*pixels)[i][0], (*pixels)[i][1]);
  }
  return view;
}

}  // namespace

Result<std::vector<PatternView>> read_point_views(const fs::path& folder, const std::string& prefix) {
  std::error_code failed;
  std::vector<fs::path> files;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    const std::string name = at->path().filename().string();
    if (name.starts_with(prefix) && name.find(kImagePoints) != std::string::npos) files.push_back(at->path());
  }
  if (failed) return Error{Errc::unreadable, folder.string() + ": " + failed.message()};
  if (files.empty())
    return Error{Errc::not_found, fmt::format("{}: no files {}*{}.N.txt", folder.string(), prefix, kImagePoints)};
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    const std::string x = a.filename().string(), y = b.filename().string();
    return std::pair(number_of(x), x) < std::pair(number_of(y), y);
  });
  std::vector<PatternView> views;
  for (const fs::path& file : files) {
    auto view = read_view(file);
    if (!view) return view.error();
    views.push_back(*std::move(view));
  }
  return views;
}

}  // namespace birdseye::host
