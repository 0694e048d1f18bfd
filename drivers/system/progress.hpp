#pragma once

#include <string>

#include "drivers/system/clock.hpp"

namespace birdseye {

/// One line of progress, in place on a terminal.
class Progress {
 public:
  Progress();
  void operator()(const std::string& what);
  void keep(const std::string& what);
  [[nodiscard]] double seconds() const { return (host_now() - began_).seconds(); }

 private:
  HostTime began_ = host_now();
  std::string last_;
  bool terminal_;
};

}  // namespace birdseye
