#pragma once

#include <string_view>

namespace birdseye {

/// Which signs of a text's notation open a level.
enum class Notation { json, toml, yaml_or_xml };

/// Whether lists, tables, elements or dotted keys lie in one another more than 64 deep, as in no file of ours. Parsers
/// call themselves for each level, and so does what copies or writes a parsed text: 20 000 of them end the program. Ask
/// before a file goes to a parser. In TOML brackets and dots multiply, to some 4300 levels, which its parser bears.
/// Brackets in strings and comments of JSON and TOML are no levels. Of YAML and XML they count, open a level and close
/// it: a text made for it passes here, so these go to a confined process alone.
[[nodiscard]] bool nests_too_deeply(std::string_view text, Notation notation);

}  // namespace birdseye
