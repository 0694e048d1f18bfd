#pragma once

#include <string>
#include <vector>

#include "host/report/svg.hpp"

namespace birdseye::host {

struct Bar {
  std::string name;
  double value = 0;
  const char* colour = kBlue;
};

/// An SVG of bars, one below the other, each with its name before and its value behind it. label: what the values are,
/// and their unit.
std::string bars_svg(const std::vector<Bar>& bars, const std::string& label);

}  // namespace birdseye::host
