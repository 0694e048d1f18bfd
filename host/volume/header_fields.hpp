#pragma once

#include <istream>
#include <map>
#include <string>
#include <string_view>

namespace birdseye::host {

/// What the text at the begin of an NRRD or MetaImage file says: values by their names, in small letters.
using HeaderFields = std::map<std::string, std::string>;

std::string_view without_blanks(std::string_view text);

/// The lines "name<sign>value" at the begin of a file, up to a blank line or the field `last`. Of NRRD's pairs
/// "name:=value" the value begins with '='.
HeaderFields header_fields(std::istream& file, char sign, const std::string& last);

}  // namespace birdseye::host
