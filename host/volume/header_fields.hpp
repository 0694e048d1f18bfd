#pragma once

#include <istream>
#include <map>
#include <string>
#include <string_view>

namespace birdseye::host {

/// What the text at the begin of an NRRD or MetaImage file says: values by their names.
using HeaderFields = std::map<std::string, std::string>;

std::string_view without_blanks(std::string_view text);

/// Behind the name of a field that a header has said before with another value.
inline constexpr std::string_view kAgain = " again";

/// Of an NRRD the lines "name: value" up to a blank one, the names in small letters and as "space units" where the file
/// has "spaceunits": its readers take both, and capitals. Of pairs "name:=value" the value begins with '='. The last of
/// several different values of a name stands under "name again".
HeaderFields nrrd_fields(std::istream& file);

struct MetaImageHeader {
  HeaderFields fields;
  /// The first line that says less to MetaIO, the reader of MetaImage, than to who reads the file, with the remedy;
  /// empty where there is none.
  std::string fault;
};

/// Of a MetaImage the lines "name = value" up to that of ElementDataFile, by MetaIO's rules: it tells capitals from
/// small letters, ends a name at '=' or ':', and passes blank lines over. Of a name that is said again as in
/// nrrd_fields.
MetaImageHeader meta_image_header(std::istream& file);

/// Empty where the header has no such field.
std::string field_of(const HeaderFields& fields, const char* name);

/// As MetaIO takes it: "True", "T", "1" and what begins as these is true, all else is not.
bool says_true(const HeaderFields& fields, const char* name);

}  // namespace birdseye::host
