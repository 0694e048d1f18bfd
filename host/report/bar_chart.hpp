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

/// An SVG of bars, one below the other, with their names before and their values behind them. label: what they are, and
/// the unit.
std::string bars_svg(const std::vector<Bar>& bars, const std::string& label);

}  // namespace birdseye::host
