#pragma once

#include <string_view>

namespace birdseye {

/// Which signs of a text's notation open a level.
enum class Notation { json, toml, yaml_or_xml };

/// Whether lists, tables, elements or dotted keys lie in one another more than 64 deep, as in no file of ours. Parsers
/// call themselves for each level, and one that is given 20 000 of them ends the program: ask before a file goes to a
/// parser.
[[nodiscard]] bool nests_too_deeply(std::string_view text, Notation notation);

}  // namespace birdseye
