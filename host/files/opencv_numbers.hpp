#pragma once

#include <string>

namespace birdseye::host {

// Whole numbers in the text of a camera file that OpenCV reads as others.

/// A whole number that fits no int: OpenCV reads another in its place. Empty where there is none.
std::string beyond_int(const std::string& text);
/// A picture's width or height that begins with 0, which OpenCV counts by eights. Empty where there is none.
std::string octal_size(const std::string& file);

}  // namespace birdseye::host
