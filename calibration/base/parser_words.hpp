#pragma once

#include <string>
#include <string_view>

namespace birdseye {

/// What a parser of TOML says is wrong: the first line of its message, for the others draw the place, without the name
/// of the function that says so ("[error] toml::parse_key: an invalid key appeared").
[[nodiscard]] inline std::string parser_words(std::string_view what) {
  what = what.substr(0, what.find('\n'));
  for (const std::string_view opening : {"[error] ", "toml::"}) {
    if (what.substr(0, opening.size()) == opening) what.remove_prefix(opening.size());
  }
  if (const auto name = what.find(": "); what.substr(0, 6) == "parse_" && name != std::string_view::npos) {
    what.remove_prefix(name + 2);
  }
  return std::string(what);
}

}  // namespace birdseye
