#include "drivers/system/program.hpp"

#include <cstdio>

namespace birdseye {

void print_error(const std::string& program, std::string what) {
  for (char& c : what) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  std::fprintf(stderr, "%s: %s\n", program.c_str(), what.c_str());
}

}  // namespace birdseye
