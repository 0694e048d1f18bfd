#include "host/guide/guide_words.hpp"

#include <array>
#include <cmath>
#include <vector>

#include "calibration/base/units.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

using calibration::BoardPlace;
using calibration::PictureWay;
using calibration::ScopeMove;

int whole_degrees(double angle_rad) {
  constexpr double kStep_deg = 5;
  return static_cast<int>(kStep_deg * std::round(angle_rad * kDegPerRad / kStep_deg));
}

const std::string& words_of(PictureWay way) {
  constexpr std::array<TextKey<0>, 8> kWays{"way_right", "way_down_right", "way_down", "way_down_left",
                                            "way_left",  "way_up_left",    "way_up",   "way_up_right"};
  return words(kWays[static_cast<std::size_t>(way)]);
}

const std::string& words_of(BoardPlace place) {
  constexpr std::array<TextKey<0>, 9> kPlaces{
      "guide_board_upper_left", "guide_board_upper",  "guide_board_upper_right",
      "guide_board_left",       "guide_board_middle", "guide_board_right",
      "guide_board_lower_left", "guide_board_lower",  "guide_board_lower_right"};
  return words(kPlaces[static_cast<std::size_t>(place)]);
}

std::string turn_words(double turn_rad) {
  constexpr std::array<TextKey<0>, 4> kEighths{"turn_eighth", "turn_quarter", "turn_three_eighths", "turn_half"};
  constexpr double kEighth_rad = 45 * kRadPerDeg, kNear_rad = 8 * kRadPerDeg;
  const double size = std::abs(turn_rad);
  const auto eighths = static_cast<std::size_t>(std::lround(size / kEighth_rad));
  const bool named = eighths > 0 && std::abs(size - static_cast<double>(eighths) * kEighth_rad) < kNear_rad;
  const std::string amount = named ? words(kEighths[eighths - 1]) : words("turn_degrees", whole_degrees(size));
  return turn_rad > 0 ? words("guide_turn_clockwise", amount) : words("guide_turn_anticlockwise", amount);
}

}  // namespace

std::string words_of(const ScopeMove& move) {
  std::vector<std::string> parts;
  if (move.tilt) parts.push_back(words("guide_tilt", whole_degrees(move.tilt->by_rad), words_of(move.tilt->way)));
  if (move.turn_rad) parts.push_back(turn_words(*move.turn_rad));
  if (move.nearer_mm) {
    parts.push_back(*move.nearer_mm > 0 ? words("guide_nearer", *move.nearer_mm)
                                        : words("guide_further", -*move.nearer_mm));
  }
  if (move.board) parts.push_back(words_of(*move.board));
  if (parts.empty()) return words("guide_hold");
  std::string out = parts.front();
  for (std::size_t i = 1; i < parts.size(); ++i)
    out = i + 1 == parts.size() ? words("list_last", out, parts[i]) : words("list_next", out, parts[i]);
  return out;
}

std::string words_of(const calibration::NextPose& next) {
  if (!next.move) return words("guide_whole_board");
  return next.from_straight ? words("guide_from_straight", words_of(*next.move)) : words_of(*next.move);
}

std::string words_of(Grade grade) {
  return grade == Grade::pass       ? words("grade_pass")
         : grade == Grade::marginal ? words("grade_marginal")
                                    : words("grade_fail");
}

}  // namespace birdseye::host
