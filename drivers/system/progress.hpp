#pragma once

#include <fmt/core.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <string>

namespace birdseye::host {

/// One line of progress, in place on a terminal.
class Progress {
 public:
  void operator()(const std::string& what) {
    if (what == last_) return;
    last_ = what;
    const double s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
    fmt::print("{}[{:5.1f} s] {}{}", terminal_ ? "\r\x1b[K" : "", s, what, terminal_ ? "" : "\n");
    std::fflush(stdout);
  }
  void keep(const std::string& what) {
    (*this)(what);
    last_.clear();
    if (terminal_) fmt::print("\n");
  }
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
  }

 private:
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  std::string last_;
  bool terminal_ = ::isatty(STDOUT_FILENO) == 1;
};

}  // namespace birdseye::host
