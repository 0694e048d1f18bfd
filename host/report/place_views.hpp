#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "host/report/svg.hpp"

namespace birdseye::host {

/// What stands at a place of a PlaceViews.
enum class PlaceShape { dot, ring, cross };

struct PlaceMark {
  Eigen::Vector3d place_mm;
  Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();  ///< an arrow from the place, drawn longer than it is
  const char* colour = kBlue;
  PlaceShape shape = PlaceShape::dot;
  std::string name = {};  ///< written beside it
};

/// Places seen along the three axes of their frame.
struct PlaceViews {
  std::array<std::string, 3> axes{"x, mm", "y, mm", "z, mm"};
  std::vector<PlaceMark> marks;
  double radius_mm = 0;  ///< of a dashed sphere about the frame's origin; 0: none
};

/// By how much arrows are to be drawn longer than they are: a round number, at least 1, that makes the longest of them
/// a sixth of the places' extent.
double arrow_times(const std::vector<PlaceMark>& marks);

/// An SVG of three panels of one scale: x and y, x and z, y and z. All places are inside. Marks that are not finite are
/// left out. times: as arrow_times() gives it.
std::string place_views_svg(const PlaceViews& views, double times);

}  // namespace birdseye::host
