#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace birdseye::calibration {

/// A text as JSON, where it says the same to whoever reads it, as one that is signed must. Discarded, as nlohmann has
/// it, where it is none, has a name twice in an object (readers take the first or the last), a zero byte (readers may
/// end there), or lists that nest deeper than any. Of json, and of ordered_json. twice: gets the last name that stood
/// twice, where it is given and there is one.
template <typename Json>
[[nodiscard]] Json strict_json(const std::string& text, std::string* twice = nullptr);

/// JSON as text, each level indented by so many blanks; in one line without white space where that is negative. Names
/// of files and what instruments say need not be UTF-8: what is not stands as U+FFFD, for no result may be lost for it.
/// Of json, and of ordered_json.
template <typename Json>
[[nodiscard]] std::string text_of_json(const Json& json, int indent = -1);

}  // namespace birdseye::calibration
