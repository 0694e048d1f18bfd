#pragma once

#include <string>
#include <utility>
#include <vector>

namespace birdseye::host {

struct Curve {
  std::string name;
  std::vector<std::pair<double, double>> points;
};
struct Panel {
  std::string title, x_label, y_label;
  std::vector<Curve> curves;  ///< at most six; a curve of the same name has the same colour in every panel
};

/// An SVG of panels side by side. The y axis begins at zero where nothing is below.
std::string plot_svg(const std::vector<Panel>& panels, int columns);

}  // namespace birdseye::host
