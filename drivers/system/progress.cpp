#include "drivers/system/progress.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <cstdio>

namespace birdseye {

Progress::Progress() : terminal_(::isatty(STDOUT_FILENO) == 1) {}

void Progress::operator()(const std::string& what) {
  if (what == last_) return;
  last_ = what;
  fmt::print("{}[{:5.1f} s] {}{}", terminal_ ? "\r\x1b[K" : "", seconds(), what, terminal_ ? "" : "\n");
  std::fflush(stdout);
}

void Progress::keep(const std::string& what) {
  (*this)(what);
  last_.clear();
  if (terminal_) fmt::print("\n");
}

}  // namespace birdseye
