#include "calibration/base/nesting.hpp"

#include <algorithm>
#include <cctype>

namespace birdseye {

namespace {

constexpr int kDeepest = 64;

/// The most brackets, or elements, that are open at once. Those in quotes count too: no text of ours has so many.
int open_at_once(std::string_view text, bool elements) {
  int open = 0, most = 0;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char sign = text[at], next = at + 1 < text.size() ? text[at + 1] : '\0';
    if (sign == '[' || sign == '{' ||
        (elements && sign == '<' && std::isalpha(static_cast<unsigned char>(next)) != 0)) {
      most = std::max(most, ++open);
    } else if (sign == ']' || sign == '}' ||
               (elements && ((sign == '<' && next == '/') || (sign == '/' && next == '>')))) {
      open = std::max(0, open - 1);
    }
  }
  return most;
}

/// The most of a sign in one stretch of nothing but it and what may stand between two of them.
int longest_run(std::string_view text, char sign, std::string_view between) {
  int run = 0, most = 0;
  for (const char other : text) {
    if (other == sign) {
      most = std::max(most, ++run);
    } else if (between.find(other) == std::string_view::npos) {
      run = 0;
    }
  }
  return most;
}

/// Of a key of TOML, as a.b.c, or of items of YAML that begin in one line, as - - - c.
int most_in_a_line(std::string_view line, Notation notation) {
  static constexpr std::string_view kKeySigns =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-\"' \t";
  if (notation == Notation::toml) return longest_run(line, '.', kKeySigns);
  // A drawn line, ------, is no item: a blank follows one.
  return line.find("- -") == std::string_view::npos ? 0 : longest_run(line, '-', " \t");
}

int most_in_any_line(std::string_view text, Notation notation) {
  int most = 0;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    // Behind a #, rows of dots may be drawn.
    most = std::max(most, most_in_a_line(line.substr(0, line.find('#')), notation));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
  }
  return most;
}

}  // namespace

bool nests_too_deeply(std::string_view text, Notation notation) {
  if (open_at_once(text, notation == Notation::yaml_or_xml) > kDeepest) return true;
  return notation != Notation::json && most_in_any_line(text, notation) > kDeepest;
}

}  // namespace birdseye
