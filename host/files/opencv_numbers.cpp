#include "host/files/opencv_numbers.hpp"

#include <algorithm>
#include <charconv>
#include <string_view>
#include <system_error>

namespace birdseye::host {

namespace {

/// Without what follows # in a line of YAML, where it is not in quotes; of XML and JSON, all.
std::string without_comments(const std::string& text) {
  if (text.substr(0, 16).find("%YAML") == std::string::npos) return text;
  std::string out;
  bool quoted = false, comment = false;
  for (const char c : text) {
    if (c == '\n') quoted = comment = false;
    if (c == '"' && !comment) quoted = !quoted;
    if (c == '#' && !quoted) comment = true;
    if (!comment) out += c;
  }
  return out;
}

/// Where in XML a tag ends whose name ends at `at`, as <image_width type_id="x">; npos where there is no such tag.
std::size_t end_of_tag(const std::string& text, std::size_t at) {
  if (at >= text.size() || std::string_view(" \t\r\n>/").find(text[at]) == std::string_view::npos)
    return std::string::npos;
  char quote = 0;
  for (; at < text.size(); ++at) {
    const char c = text[at];
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '>') {
      return at;
    }
  }
  return std::string::npos;
}

}  // namespace

std::string beyond_int(const std::string& text) {
  constexpr const char* kBetween = " \t\r\n,:[]{}<>";
  std::size_t end = 0;
  for (std::size_t at = 0; (at = text.find_first_not_of(kBetween, end)) != std::string::npos;) {
    end = std::min(text.find_first_of(kBetween, at), text.size());
    int value = 0;
    const char* const first = text.data() + at + (text[at] == '+' ? 1 : 0);
    const auto [rest, failed] = std::from_chars(first, text.data() + end, value);
    if (failed == std::errc::result_out_of_range && rest == text.data() + end) return text.substr(at, end - at);
  }
  return {};
}

std::string octal_size(const std::string& file) {
  constexpr std::string_view kDigits = "0123456789", kBeforeKey = "\n\"<{,-", kAfterKey = ":>";
  constexpr const char* kBeforeNumber = " \t\r\n\":>+-";
  const std::string text = without_comments(file);
  for (const std::string_view key : {"image_width", "image_height"}) {
    for (auto at = text.find(key); at != std::string::npos; at = text.find(key, at + 1)) {
      const auto before = at == 0 ? std::string::npos : text.find_last_not_of(" \t\r", at - 1);
      if (before != std::string::npos && kBeforeKey.find(text[before]) == std::string_view::npos) continue;
      const bool tag = before != std::string::npos && text[before] == '<';
      const auto told = tag ? end_of_tag(text, at + key.size()) : text.find_first_not_of(" \t\r\n\"", at + key.size());
      if (told == std::string::npos || kAfterKey.find(text[told]) == std::string_view::npos) continue;
      auto from = text.find_first_not_of(kBeforeNumber, told);
      if (from != std::string::npos && text[from] == '!')  // a tag, as !!int
        from = text.find_first_not_of(kBeforeNumber, text.find_first_of(" \t\r\n", from));
      from = std::min(from, text.size());
      const auto end = std::min(text.find_first_not_of(kDigits, from), text.size());
      if (end - from > 1 && text[from] == '0') return text.substr(from, end - from);
    }
  }
  return {};
}

}  // namespace birdseye::host
