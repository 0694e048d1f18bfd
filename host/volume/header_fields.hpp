#pragma once

#include <istream>
#include <map>
#include <string>
#include <string_view>

namespace birdseye::host {

/// What the text at the begin of an NRRD or MetaImage file says: values by their names, in small letters.
using HeaderFields = std::map<std::string, std::string>;

std::string_view without_blanks(std::string_view text);

/// Behind the name of a field that a header has said before with another value.
inline constexpr std::string_view kAgain = " again";

/// The lines "name<sign>value" at the begin of a file, up to a blank line or the field `last`. Of NRRD's pairs
/// "name:=value" the value begins with '='. The last of several different values of a name stands under "name again".
HeaderFields header_fields(std::istream& file, char sign, const std::string& last);

/// Empty where the header has no such field.
std::string field_of(const HeaderFields& fields, const char* name);

/// As MetaIO takes it: "True", "T", "1" and what begins as these is true, all else is not.
bool says_true(const HeaderFields& fields, const char* name);

}  // namespace birdseye::host
