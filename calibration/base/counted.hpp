#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <string>

namespace birdseye {

/// A count in words: "1 pose", "12 poses".
inline std::string counted(std::size_t count, const char* one, const char* many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

}  // namespace birdseye
