#include "drivers/system/program.hpp"

#include <algorithm>
#include <cstdio>

namespace birdseye {

std::string in_one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 32 || c == 127; }, ' ');
  return text;
}

void print_error(const std::string& program, const std::string& what) {
  std::fprintf(stderr, "%s: %s\n", program.c_str(), in_one_line(what).c_str());
}

}  // namespace birdseye
