#include "calibration/base/nesting.hpp"

#include <algorithm>
#include <cctype>
#include <string>

namespace birdseye {

namespace {

constexpr int kDeepest = 64;

/// A place in a text.
struct Reader {
  std::string_view text;
  std::size_t at = 0;

  [[nodiscard]] bool ended() const { return at >= text.size(); }
  [[nodiscard]] bool shows(std::string_view signs) const { return text.substr(at).starts_with(signs); }
};

/// Goes behind a string of several lines in three quotes. Up to two quotes more belong to its end.
void pass_over_lines(Reader& reader, std::string_view quotes, bool escapes) {
  for (reader.at += quotes.size(); !reader.ended(); ++reader.at) {
    if (reader.shows(quotes)) {
      reader.at += quotes.size();
      for (int more = 0; more < 2 && reader.shows(quotes.substr(0, 1)); ++more) ++reader.at;
      return;
    }
    if (escapes && reader.shows("\\")) ++reader.at;
  }
}

/// Goes behind a string of one line. The line's end ends the string too: there the parser gives up.
void pass_over_string(Reader& reader, char quote, bool escapes) {
  for (++reader.at; !reader.ended() && reader.text[reader.at] != '\n'; ++reader.at) {
    if (reader.text[reader.at] == quote) {
      ++reader.at;
      return;
    }
    if (escapes && reader.text[reader.at] == '\\') ++reader.at;
  }
}

/// The text with an s in place of each string, and without comments: brackets in strings and comments open no level.
/// Until the parser's first fault, at which it stops, the parser takes the same for strings and comments.
std::string without_strings(std::string_view text, Notation notation) {
  std::string out;
  out.reserve(text.size());
  Reader reader{text};
  while (!reader.ended()) {
    const char sign = text[reader.at];
    const bool literal = notation == Notation::toml && sign == '\'';
    if (notation == Notation::toml && sign == '#') {
      reader.at = std::min(text.size(), text.find('\n', reader.at));
    } else if (notation == Notation::toml && (reader.shows(R"(""")") || reader.shows("'''"))) {
      pass_over_lines(reader, text.substr(reader.at, 3), !literal);
      out += 's';
    } else if (sign == '"' || literal) {
      pass_over_string(reader, sign, !literal);
      out += 's';
    } else {
      out += sign;
      ++reader.at;
    }
  }
  return out;
}

/// The most brackets, or elements, that are open at once.
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
    // Behind a #, rows of dashes may be drawn.
    most = std::max(most, most_in_a_line(line.substr(0, line.find('#')), notation));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
  }
  return most;
}

}  // namespace

bool nests_too_deeply(std::string_view text, Notation notation) {
  if (notation == Notation::yaml_or_xml)
    return open_at_once(text, true) > kDeepest || most_in_any_line(text, notation) > kDeepest;
  const std::string signs = without_strings(text, notation);
  return open_at_once(signs, false) > kDeepest ||
         (notation == Notation::toml && most_in_any_line(signs, notation) > kDeepest);
}

}  // namespace birdseye
