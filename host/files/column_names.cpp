#include "host/files/column_names.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <set>

#include "calibration/base/lower_case.hpp"
#include "host/files/text_rows.hpp"

namespace birdseye::host {

namespace {

using Words = std::set<std::string, std::less<>>;

const std::map<std::string, double, std::less<>> kLengths{{"mm", 1},    {"cm", 10},       {"m", 1000},
                                                          {"in", 25.4}, {"inch", 25.4},   {"inches", 25.4},
                                                          {"um", 1e-3}, {"\u00b5m", 1e-3}};
const std::map<std::string, double, std::less<>> kTimes{{"s", 1},     {"sec", 1},   {"seconds", 1},   {"ms", 1e-3},
                                                        {"us", 1e-6}, {"ns", 1e-9}, {"\u00b5s", 1e-6}};
const Words kTimeWords{"t", "time", "timestamp", "timestamps", "stamp", "sec", "secs", "seconds"};
const Words kPositionWords{"p", "pos", "position", "t", "trans", "translation", "loc", "location"};
const Words kTurnWords{"q", "quat", "quaternion", "orientation", "rotation", "rot"};

std::optional<double> value_in(const std::map<std::string, double, std::less<>>& units, std::string_view unit) {
  const auto found = units.find(unit);
  if (found == units.end()) return std::nullopt;
  return found->second;
}

/// Takes "[m]" or "(mm)" off the end of a name.
std::string take_bracketed(std::string& name) {
  const auto open = name.find_last_of("[(");
  const auto close = name.find_last_of("])");
  if (open == std::string::npos || close == std::string::npos || close < open) return {};
  std::string unit = name.substr(open + 1, close - open - 1);
  name.erase(open);
  return unit;
}

/// x, y, z or w as 0 to 3.
std::optional<std::size_t> axis_of(std::string_view letter) {
  const auto at = std::string_view("xyzw").find(letter);
  if (letter.size() != 1 || at == std::string_view::npos) return std::nullopt;
  return at;
}

PoseColumn position(std::size_t axis) {
  return static_cast<PoseColumn>(1 + axis);
}

PoseColumn turn(std::size_t axis) {
  return static_cast<PoseColumn>(4 + axis);
}

/// Of one word: x, tx, px, qx, q0 to q3, of which the first is w.
std::optional<PoseColumn> of_word(std::string_view word) {
  if (word == "q0") return PoseColumn::qw;
  if (word == "q1" || word == "q2" || word == "q3") return turn(static_cast<std::size_t>(word[1] - '1'));
  const auto axis = axis_of(word.substr(word.empty() ? 0 : word.size() - 1));
  if (!axis || word.size() > 2) return std::nullopt;
  if (word.size() == 2 && word[0] == 'q') return turn(*axis);
  if (*axis < 3 && (word.size() == 1 || word[0] == 't' || word[0] == 'p')) return position(*axis);
  return std::nullopt;
}

}  // namespace

ColumnName column_name(std::string_view text) {
  std::string name = lower_case(text);
  ColumnName out;
  out.unit = take_bracketed(name);
  for (const char c : name) {
    const bool letter = std::isalnum(static_cast<unsigned char>(c)) != 0;
    if (letter && (out.words.empty() || out.words.back().empty())) {
      if (out.words.empty()) out.words.emplace_back();
      out.words.back() += c;
    } else if (letter) {
      out.words.back() += c;
    } else if (!out.words.empty() && !out.words.back().empty()) {
      out.words.emplace_back();
    }
  }
  if (!out.words.empty() && out.words.back().empty()) out.words.pop_back();
  const bool ends_in_unit = out.words.size() > 1 && (mm_per(out.words.back()) || seconds_per(out.words.back()));
  if (out.unit.empty() && ends_in_unit) {
    out.unit = out.words.back();
    out.words.pop_back();
  }
  return out;
}

std::optional<double> mm_per(std::string_view unit) {
  return value_in(kLengths, unit);
}

std::optional<double> seconds_per(std::string_view unit) {
  return value_in(kTimes, unit);
}

std::string name_of_mm(double mm_per_unit) {
  if (mm_per_unit == 1) return "mm";
  if (mm_per_unit == 10) return "cm";
  if (mm_per_unit == 1000) return "metres";
  if (mm_per_unit == 25.4) return "inches";
  return "micrometres";
}

std::string name_of_seconds(double s_per_unit) {
  if (s_per_unit == 1) return "seconds";
  if (s_per_unit == 1e-3) return "milliseconds";
  return s_per_unit == 1e-6 ? "microseconds" : "nanoseconds";
}

std::optional<PoseColumn> pose_column(const ColumnName& name) {
  if (name.words.empty()) return std::nullopt;
  const auto any_of = [&](const Words& known) {
    return std::any_of(name.words.begin(), name.words.end(), [&](const auto& word) { return known.contains(word); });
  };
  const auto axis = axis_of(name.words.back());
  if (name.words.size() > 1 && axis) {
    if (any_of(kTurnWords)) return turn(*axis);
    if (*axis < 3 && any_of(kPositionWords)) return position(*axis);
    return std::nullopt;
  }
  if (const auto found = of_word(name.words.back())) return found;
  if (kTimeWords.contains(name.words.back())) return PoseColumn::time;
  return std::nullopt;
}

}  // namespace birdseye::host
