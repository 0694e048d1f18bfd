#pragma once

#include <string>

namespace birdseye::calibration {

/// Whether a text is JSON that says the same to whoever reads it, as one that is signed must. False where it has a name
/// twice in an object (readers take the first or the last), a zero byte (readers may end there), or lists that nest
/// deeper than any.
[[nodiscard]] bool is_strict_json(const std::string& text);

}  // namespace birdseye::calibration
