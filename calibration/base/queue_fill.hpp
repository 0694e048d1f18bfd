#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace birdseye {

/// How full a queue is, beside its bounds.
struct QueueFill {
  std::string queue;  ///< between whom, and of what
  std::size_t values = 0, most_values = SIZE_MAX;
  std::size_t bytes = 0, most_bytes = SIZE_MAX;
};

}  // namespace birdseye
