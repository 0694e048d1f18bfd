#include "calibration/detect/pattern.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <opencv2/aruco/dictionary.hpp>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>

namespace birdseye::calibration {

namespace {

using std::string_view;

constexpr int kMostCount = 200;    // more than this along a side no camera resolves
constexpr double kLeastMm = 0.05;  // a printed spacing is neither below this ..
constexpr double kMostMm = 1000;   // .. nor above this: a wrong unit

constexpr const char* kExamples =
    "give chessboard:14x10:3mm (inner corners), charuco:19x26:5mm:4mm:DICT_4X4_250[:legacy][:inset=8x13:3mm] (squares; "
    "inner corners of a chessboard in its middle), dots:11x9:4mm, "
    "dots:4x11:5mm:asymmetric, dots:25x18:3mm:markers=133,141,308,317 or dots:19x15:2mm:bars=142-146,105-181";

/// The predefined dictionaries, in the order of OpenCV's numbers.
constexpr std::array<const char*, 21> kDictionaries = {
    "DICT_4X4_50",        "DICT_4X4_100",        "DICT_4X4_250",       "DICT_4X4_1000",      "DICT_5X5_50",
    "DICT_5X5_100",       "DICT_5X5_250",        "DICT_5X5_1000",      "DICT_6X6_50",        "DICT_6X6_100",
    "DICT_6X6_250",       "DICT_6X6_1000",       "DICT_7X7_50",        "DICT_7X7_100",       "DICT_7X7_250",
    "DICT_7X7_1000",      "DICT_ARUCO_ORIGINAL", "DICT_APRILTAG_16h5", "DICT_APRILTAG_25h9", "DICT_APRILTAG_36h10",
    "DICT_APRILTAG_36h11"};

std::vector<string_view> split(string_view text, char at) {
  std::vector<string_view> parts;
  for (;;) {
    const std::size_t end = text.find(at);
    parts.push_back(text.substr(0, end));
    if (end == string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

template <typename Number>
std::optional<Number> number_of(string_view text) {
  Number value{};
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// "3mm", "0.3cm", "0.003m" -> 3.
std::optional<double> length_mm(string_view text) {
  for (const auto& [unit, mm] : {std::pair<string_view, double>{"mm", 1}, {"cm", 10}, {"m", 1000}}) {
    if (!text.ends_with(unit)) continue;
    const auto value = number_of<double>(text.substr(0, text.size() - unit.size()));
    if (!value || !(*value * mm >= kLeastMm) || !(*value * mm <= kMostMm)) return std::nullopt;
    return *value * mm;
  }
  return std::nullopt;
}

Error wrong(const std::string& spec, const std::string& why) {
  return {Errc::bad_value, fmt::format("pattern \"{}\": {}; {}", spec, why, kExamples)};
}

Result<std::pair<int, int>> read_counts(const Pattern& pattern, string_view text) {
  const auto counts = split(text, 'x');
  const auto columns = counts.size() == 2 ? number_of<int>(counts[0]) : std::nullopt;
  const auto rows = counts.size() == 2 ? number_of<int>(counts[1]) : std::nullopt;
  if (!columns || !rows || *columns < 3 || *rows < 3 || *columns > kMostCount || *rows > kMostCount)
    return wrong(pattern.spec, fmt::format("\"{}\" is not COLUMNSxROWS of 3 to {} each", text, kMostCount));
  return std::pair(*columns, *rows);
}

Result<double> read_length(const Pattern& pattern, string_view text) {
  const auto mm = length_mm(text);
  if (!mm) {
    return wrong(pattern.spec,
                 fmt::format("\"{}\" is no length of {} to {} mm with its unit mm, cm or m", text, kLeastMm, kMostMm));
  }
  return *mm;
}

/// Takes `inset=8x13:3mm` off the end, where it is.
Result<void> take_inset(Pattern& pattern, std::vector<string_view>& parts) {
  constexpr string_view kInset = "inset=";
  if (parts.size() < 2 || !parts[parts.size() - 2].starts_with(kInset)) return {};
  const auto counts = read_counts(pattern, parts[parts.size() - 2].substr(kInset.size()));
  if (!counts) return counts.error();
  const auto side = read_length(pattern, parts.back());
  if (!side) return side.error();
  std::tie(pattern.inset_columns, pattern.inset_rows) = *counts;
  pattern.inset_mm = *side;
  const double width_mm = (pattern.inset_columns + 1) * *side, height_mm = (pattern.inset_rows + 1) * *side;
  if (width_mm > (pattern.columns - 2) * pattern.spacing_mm || height_mm > (pattern.rows - 2) * pattern.spacing_mm)
    return wrong(pattern.spec, fmt::format("an inset of {:g}x{:g} mm leaves no tags around it", width_mm, height_mm));
  parts.resize(parts.size() - 2);
  return {};
}

Result<Pattern> read_charuco(Pattern pattern, std::vector<string_view> parts) {
  if (const auto taken = take_inset(pattern, parts); !taken) return taken.error();
  if (parts.size() < 5 || parts.size() > 6 || (parts.size() == 6 && parts[5] != "legacy"))
    return wrong(pattern.spec, "a ChArUco board needs squares, their side, the tags' side and the dictionary");
  const auto tag = read_length(pattern, parts[3]);
  if (!tag) return tag.error();
  pattern.tag_mm = *tag;
  if (pattern.tag_mm >= pattern.spacing_mm)
    return wrong(pattern.spec,
                 fmt::format("tags of {} mm do not fit squares of {} mm", pattern.tag_mm, pattern.spacing_mm));
  const auto* const found = std::find(kDictionaries.begin(), kDictionaries.end(), parts[4]);
  if (found == kDictionaries.end())
    return wrong(pattern.spec, fmt::format("\"{}\" is no dictionary of OpenCV's, as DICT_4X4_250", parts[4]));
  pattern.dictionary = static_cast<int>(found - kDictionaries.begin());
  pattern.legacy = parts.size() == 6;
  const int held = cv::aruco::Dictionary::get(pattern.dictionary)->bytesList.rows;
  const int needed = pattern.columns * pattern.rows / 2;
  if (needed > held)
    return wrong(pattern.spec, fmt::format("{} has {} tags, the board needs {}", parts[4], held, needed));
  return pattern;
}

/// Dots, turned with the grid by a quarter `quarters` times about its middle.
std::vector<int> turned(const Pattern& pattern, const std::vector<int>& dots, int quarters) {
  std::vector<int> ids;
  for (const int id : dots) {
    int column = id % pattern.columns;
    int row = id / pattern.columns;
    int columns = pattern.columns;
    int rows = pattern.rows;
    for (int k = 0; k < quarters; ++k) {
      std::swap(columns, rows);
      const int before = column;
      column = columns - 1 - row;
      row = before;
    }
    ids.push_back(row * pattern.columns + column);
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

/// Whether a turn brings larger dots onto larger dots and bars onto bars.
bool same_turned(const Pattern& pattern, int quarters) {
  return turned(pattern, pattern.larger_dots, quarters) == pattern.larger_dots &&
         turned(pattern, pattern.under_bars, quarters) == pattern.under_bars;
}

void note_symmetry(Pattern& pattern) {
  const bool square = pattern.columns == pattern.rows;
  switch (pattern.kind) {
    case PatternKind::charuco:
      return;
    case PatternKind::chessboard:
      // The squares number one more than the corners; a turn that swaps the colours tells the ends apart.
      pattern.half_turn_ambiguous = (pattern.columns + pattern.rows) % 2 == 0;
      pattern.quarter_turn_ambiguous = square && pattern.columns % 2 == 0;
      return;
    case PatternKind::dots:
      // The first row of an asymmetric grid is to the left; half a turn puts the last one to the right.
      pattern.half_turn_ambiguous = pattern.asymmetric ? pattern.rows % 2 == 0 : same_turned(pattern, 2);
      pattern.quarter_turn_ambiguous = square && !pattern.asymmetric && same_turned(pattern, 1);
      return;
  }
}

Result<int> read_dot(const Pattern& pattern, string_view text) {
  const auto id = number_of<int>(text);
  if (id && *id >= 0 && *id < pattern.columns * pattern.rows) return *id;
  return wrong(pattern.spec,
               fmt::format("\"{}\" is no dot's number, 0 to {}", text, pattern.columns * pattern.rows - 1));
}

Result<void> read_markers(Pattern& pattern, string_view list) {
  for (const string_view text : split(list, ',')) {
    const auto id = read_dot(pattern, text);
    if (!id) return id.error();
    pattern.larger_dots.push_back(*id);
  }
  auto& ids = pattern.larger_dots;
  std::sort(ids.begin(), ids.end());
  if (std::adjacent_find(ids.begin(), ids.end()) != ids.end() || ids.size() < Pattern::kLeastLargerDots)
    return wrong(pattern.spec, fmt::format("{} or more different dots must be larger", Pattern::kLeastLargerDots));
  return {};
}

Result<void> read_bars(Pattern& pattern, string_view list) {
  for (const string_view text : split(list, ',')) {
    const auto ends = split(text, '-');
    if (ends.size() != 2) return wrong(pattern.spec, fmt::format("\"{}\" is no bar, as 142-146", text));
    const auto first = read_dot(pattern, ends[0]), last = read_dot(pattern, ends[1]);
    if (!first) return first.error();
    if (!last) return last.error();
    const bool along = *first / pattern.columns == *last / pattern.columns;
    const bool down = *first % pattern.columns == *last % pattern.columns;
    if (*first >= *last || (!along && !down))
      return wrong(pattern.spec, fmt::format("the bar \"{}\" runs along no row or column from left or top", text));
    for (int id = *first; id <= *last; id += along ? 1 : pattern.columns) pattern.under_bars.push_back(id);
  }
  auto& ids = pattern.under_bars;
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  if (ids.size() < Pattern::kLeastUnderBars)
    return wrong(pattern.spec, fmt::format("bars must cover {} places or more", Pattern::kLeastUnderBars));
  return {};
}

Result<Pattern> read_dots(Pattern pattern, const std::vector<string_view>& parts) {
  constexpr string_view kMarkers = "markers=", kBars = "bars=";
  for (std::size_t i = 3; i < parts.size(); ++i) {
    Result<void> read;
    if (parts[i] == "asymmetric" && parts.size() == 4) {
      pattern.asymmetric = true;
    } else if (parts[i].starts_with(kMarkers) && pattern.larger_dots.empty()) {
      read = read_markers(pattern, parts[i].substr(kMarkers.size()));
    } else if (parts[i].starts_with(kBars) && pattern.under_bars.empty()) {
      read = read_bars(pattern, parts[i].substr(kBars.size()));
    } else {
      return wrong(pattern.spec,
                   "after a dot grid's spacing comes asymmetric, markers=ID,ID,.., bars=ID-ID,ID-ID,.. or nothing");
    }
    if (!read) return read.error();
  }
  const auto under_bar = [&](int id) { return std::ranges::binary_search(pattern.under_bars, id); };
  if (std::ranges::any_of(pattern.larger_dots, under_bar)) return wrong(pattern.spec, "a larger dot lies under a bar");
  return pattern;
}

}  // namespace

Result<Pattern> parse_pattern(const std::string& spec) {
  Pattern pattern;
  pattern.spec = spec;
  const auto parts = split(spec, ':');
  if (parts[0] == "charuco") {
    pattern.kind = PatternKind::charuco;
  } else if (parts[0] == "dots") {
    pattern.kind = PatternKind::dots;
  } else if (parts[0] != "chessboard") {
    return wrong(spec, fmt::format("\"{}\" is no kind of pattern", parts[0]));
  }
  if (parts.size() < 3) return wrong(spec, "counts and lengths are missing");
  const auto counts = read_counts(pattern, parts[1]);
  if (!counts) return counts.error();
  std::tie(pattern.columns, pattern.rows) = *counts;
  const auto spacing = read_length(pattern, parts[2]);
  if (!spacing) return spacing.error();
  pattern.spacing_mm = *spacing;
  Result<Pattern> result = pattern;
  if (pattern.kind == PatternKind::charuco) {
    result = read_charuco(pattern, parts);
  } else if (pattern.kind == PatternKind::dots) {
    result = read_dots(pattern, parts);
  } else if (parts.size() != 3) {
    return wrong(spec, "nothing comes after a chessboard's square");
  }
  if (result) note_symmetry(*result);
  return result;
}

std::vector<Eigen::Vector3d> pattern_points_mm(const Pattern& pattern) {
  std::vector<Eigen::Vector3d> points;
  const int less = pattern.kind == PatternKind::charuco ? 1 : 0;
  for (int row = 0; row < pattern.rows - less; ++row) {
    for (int column = 0; column < pattern.columns - less; ++column) {
      const int x = pattern.asymmetric ? 2 * column + row % 2 : column + less;
      points.emplace_back(x * pattern.spacing_mm, (row + less) * pattern.spacing_mm, 0);
    }
  }
  const Eigen::Vector2d middle = 0.5 * pattern.spacing_mm * Eigen::Vector2d(pattern.columns, pattern.rows);
  for (int row = 0; row < pattern.inset_rows; ++row) {
    for (int column = 0; column < pattern.inset_columns; ++column) {
      points.emplace_back(middle.x() + (column - 0.5 * (pattern.inset_columns - 1)) * pattern.inset_mm,
                          middle.y() + (row - 0.5 * (pattern.inset_rows - 1)) * pattern.inset_mm, 0);
    }
  }
  return points;
}

std::vector<TagPlace> tag_places(const Pattern& pattern) {
  // OpenCV numbers the tags row by row from the top. From 4.6 on the first square is black, always; before, the first
  // square of the last row was, which is another layout where the rows are even.
  const int first_white = pattern.legacy && pattern.rows % 2 == 0 ? 0 : 1;
  std::vector<TagPlace> places;
  for (int row = 0; row < pattern.rows; ++row) {
    for (int column = 0; column < pattern.columns; ++column) {
      if ((column + row) % 2 == first_white) places.push_back({column, row});
    }
  }
  return places;
}

}  // namespace birdseye::calibration
