#include "host/files/point_sets.hpp"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <optional>

#include "calibration/base/lower_case.hpp"
#include "calibration/record/strict_json.hpp"
#include "drivers/system/whole_file.hpp"
#include "host/files/pose_collector.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostBytes = 10'000'000;

Result<std::string> text_of_file(const fs::path& path) {
  auto text = read_whole_file(path, kMostBytes);
  if (text || text.error().code != Errc::unsupported) return text;
  return Error{Errc::unsupported, fmt::format("{}: is larger than 10 MB; is it a list of points?", path.string())};
}

/// Whether a markup's unit is mm: not told, "mm", or a coded term as ["mm", "UCUM", "millimeter"].
bool in_mm(const nlohmann::json& markup) {
  const auto unit = markup.find("coordinateUnits");
  if (unit == markup.end()) return true;
  const nlohmann::json& word = unit->is_array() && !unit->empty() ? unit->front() : *unit;
  return word.is_string() && word.get<std::string>() == "mm";
}

/// What stands between <tag> and </tag>, from `at` on; at is then behind it.
std::optional<std::string_view> next_element(std::string_view text, std::string_view tag, std::size_t& at) {
  const std::string open = fmt::format("<{}>", tag), close = fmt::format("</{}>", tag);
  const std::size_t from = text.find(open, at);
  const std::size_t to = from == std::string_view::npos ? from : text.find(close, from);
  if (to == std::string_view::npos) return std::nullopt;
  at = to + close.size();
  return text.substr(from + open.size(), to - from - open.size());
}

/// The value of an attribute of the first <tag ...>.
std::optional<double> attribute_of(std::string_view text, std::string_view tag, std::string_view name) {
  const std::size_t from = text.find(fmt::format("<{} ", tag));
  if (from == std::string_view::npos) return std::nullopt;
  text = text.substr(from, text.find('>', from) - from);
  const std::string key = fmt::format(" {}=\"", name);
  const std::size_t at = text.find(key);
  if (at == std::string_view::npos) return std::nullopt;
  text.remove_prefix(at + key.size());
  const ReadNumber number = read_number(text.substr(0, text.find('"')));
  if (!number.problem.empty()) return std::nullopt;
  return number.value;
}

/// Whether the file's IndexToWorld and Offset leave points where they are, as of a set that was placed by itself.
bool has_no_geometry(std::string_view text) {
  if (text.find("<Geometry3D") == std::string_view::npos) return true;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      if (attribute_of(text, "IndexToWorld", fmt::format("m_{}_{}", row, column)) != (row == column ? 1 : 0))
        return false;
    }
    if (attribute_of(text, "Offset", std::string(1, "xyz"[row])) != 0) return false;
  }
  return true;
}

}  // namespace

StatedFrame frame_of_word(std::string_view word) {
  const std::string lower = lower_case(trimmed(word));
  if (lower == "lps" || lower == "1") return StatedFrame::lps;
  if (lower == "ras" || lower == "0") return StatedFrame::ras;
  return StatedFrame::none;
}

Result<StatedPoints> read_slicer_markups(const fs::path& path) {
  const auto text = text_of_file(path);
  if (!text) return text.error();
  const auto wrong = [&](const std::string& why) {
    return Error{Errc::bad_format, fmt::format("{}: {}", path.string(), why)};
  };
  try {
    std::string twice;
    const auto json = calibration::strict_json<nlohmann::json>(*text, &twice);
    if (!twice.empty())
      return wrong(fmt::format("\"{}\" stands twice in it; take out the one that is not meant", twice));
    const nlohmann::json& markups = json.at("markups");
    if (!markups.is_array() || markups.size() != 1)
      return wrong(fmt::format("holds {} lists of points; save the one that is meant", markups.size()));
    const nlohmann::json& markup = markups.front();
    StatedPoints out;
    out.frame = frame_of_word(markup.at("coordinateSystem").get<std::string>());
    if (out.frame == StatedFrame::none)
      return wrong("\"coordinateSystem\" is neither LPS nor RAS; save the points by 3D Slicer again");
    if (!in_mm(markup)) return wrong("\"coordinateUnits\" is not mm; save the points in mm");
    for (const nlohmann::json& point : markup.at("controlPoints")) {
      std::string name = point.value("label", "");
      if (point.value("positionStatus", "defined") != "defined") {
        out.notes.push_back(fmt::format("{}: point \"{}\" has no place yet, and is passed over", path.string(), name));
        continue;
      }
      const auto p = point.at("position").get<std::array<double, 3>>();
      out.points.push_back({std::move(name), {p[0], p[1], p[2]}});
    }
    return out;
  } catch (const nlohmann::json::exception&) {
    return wrong(
        "is no list of points as 3D Slicer saves it; save the points as .mrk.json or .fcsv, or give a text "
        "with a line x y z for each");
  }
}

Result<StatedPoints> read_mitk_points(const fs::path& path) {
  const auto text = text_of_file(path);
  if (!text) return text.error();
  const auto wrong = [&](const std::string& why) {
    return Error{Errc::bad_format, fmt::format("{}: {}", path.string(), why)};
  };
  std::size_t at = 0, inside = 0;
  const auto series = next_element(*text, "time_series", at);
  if (!series || text->find("<point_set_file>") == std::string::npos)
    return wrong("is no point set as MITK saves it; save the points again, or give a text with a line x y z for each");
  if (next_element(*text, "time_series", at)) return wrong("holds several time steps; save the one that is meant");
  if (!has_no_geometry(*series))
    return wrong(
        "its points have a geometry of their own (IndexToWorld, Offset); give a text with a line x y z for "
        "each, patient LPS, mm");
  StatedPoints out;
  out.frame = StatedFrame::lps;
  while (const auto point = next_element(*series, "point", inside)) {
    Eigen::Vector3d place_mm;
    for (int axis = 0; axis < 3; ++axis) {
      std::size_t start = 0;
      const auto value = next_element(*point, std::string(1, "xyz"[axis]), start);
      const ReadNumber number = read_number(value.value_or(""));
      if (!number.problem.empty()) {
        return wrong(fmt::format("point {}: {} is {}; save the points again", out.points.size() + 1, "xyz"[axis],
                                 number.problem));
      }
      place_mm[axis] = number.value;
    }
    out.points.push_back({"", place_mm});
  }
  return out;
}

}  // namespace birdseye::host
