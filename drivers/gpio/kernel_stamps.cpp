#include "drivers/gpio/kernel_stamps.hpp"

#include <cstdio>
#include <utility>

namespace birdseye::drivers {

bool stamps_edges_monotonic(const std::string& release) {
  int major = 0;
  int minor = 0;
  if (std::sscanf(release.c_str(), "%d.%d", &major, &minor) != 2) return false;  // NOLINT(cert-err34-c): two numbers
  return std::pair(major, minor) >= std::pair(5, 7);
}

}  // namespace birdseye::drivers
