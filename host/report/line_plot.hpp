#pragma once

#include <string>
#include <utility>
#include <vector>

namespace birdseye::host {

struct Curve {
  std::string name;
  std::vector<std::pair<double, double>> points;  ///< one that is not finite breaks the line
};
/// A vertical line through the plot where something begins.
struct Mark {
  double x;
  std::string text;
};
struct Panel {
  std::string title, x_label, y_label;
  std::vector<Curve> curves;  ///< at most six; a curve of the same name has the same colour and dashes in every panel
  bool from_zero = true;      ///< the y axis begins at 0, where no value is below
  std::vector<Mark> marks = {};
};
struct PanelSize {
  double width = 460, height = 300;
};

/// An SVG of panels side by side.
std::string plot_svg(const std::vector<Panel>& panels, int columns, const PanelSize& size = {});

}  // namespace birdseye::host
