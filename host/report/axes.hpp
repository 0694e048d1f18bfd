#pragma once

#include <string>
#include <vector>

namespace birdseye::host {

/// The nearest of 1, 2 and 5 times a power of ten that is not below, or not above, a positive value.
double round_up(double value);
double round_down(double value);

/// Numbers from low to high; none before the first include().
struct Range {
  double low = 1e300, high = -1e300;
  void include(double value);
  [[nodiscard]] double size() const { return high - low; }
};

struct Axis {
  Range range;        ///< an empty range, or one without size, is replaced by one with a size
  std::string label;  ///< what it shows and the unit: "lag, ms"
  int ticks = 4;      ///< about so many, at round numbers; 0: none
};

/// The area of a plot on its picture; numbers and labels of the axes lie outside of it.
struct PlotArea {
  double left, top, width, height;
};

/// The axes of a plot: where its numbers lie on the picture.
class Axes {
 public:
  /// The room that numbers and label need to the left of the area and below it.
  static constexpr double kLeft = 58, kBelow = 40;

  Axes(const PlotArea& area, Axis x, Axis y);

  [[nodiscard]] double x_of(double value) const;
  [[nodiscard]] double y_of(double value) const;
  [[nodiscard]] const PlotArea& area() const { return area_; }
  /// Lines, ticks, their grid, numbers and labels: to be drawn first.
  [[nodiscard]] std::string svg() const;

 private:
  PlotArea area_;
  Axis x_, y_;
};

/// The rings of a round plot of angles, each with its number; outer_deg lies at the radius.
std::string rings_svg(double middle_x, double middle_y, double radius, double outer_deg, double apart_deg);

}  // namespace birdseye::host
