#pragma once

#include <string>
#include <string_view>

namespace birdseye::host {

/// The phase of the contrast medium that a text names, in the words of several languages and their usual abbreviations:
/// "native", "arterial", "portal venous" or "delayed". Empty where it names none, or more than one.
std::string phase_named_in(std::string_view text);

}  // namespace birdseye::host
