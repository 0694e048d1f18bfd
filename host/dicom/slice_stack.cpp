#include "host/dicom/slice_stack.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calibration/base/median.hpp"
#include "calibration/base/units.hpp"

namespace birdseye::host {

namespace {

double degrees(double sideways_mm, double forward_mm) {
  return std::atan2(sideways_mm, forward_mm) * kDegPerRad;
}

/// 0 where each step is straight, and the far end lies where a straight stack puts it.
double tilt_of(const std::vector<DicomSlice>& slices, const Eigen::Vector3d& normal) {
  const auto sideways_of = [&normal](const Eigen::Vector3d& move) { return (move - move.dot(normal) * normal).norm(); };
  for (std::size_t i = 1; i < slices.size(); ++i) {
    const Eigen::Vector3d move = slices[i].position_mm - slices[i - 1].position_mm;
    const double forward = move.dot(normal);
    if (sideways_of(move) > 0.02 * forward + 0.01) return degrees(sideways_of(move), forward);
  }
  const Eigen::Vector3d whole = slices.back().position_mm - slices.front().position_mm;
  if (sideways_of(whole) > 0.5 * slices.front().spacing_mm.minCoeff())
    return degrees(sideways_of(whole), whole.dot(normal));
  return 0;
}

/// A tilted gantry leaves all slices on the line from the first to the last: how far the worst one lies off that line.
double beside_line_mm(const std::vector<DicomSlice>& slices, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d whole = slices.back().position_mm - slices.front().position_mm;
  double most_mm = 0;
  for (const DicomSlice& slice : slices) {
    const Eigen::Vector3d move = slice.position_mm - slices.front().position_mm;
    most_mm = std::max(most_mm, (move - move.dot(normal) / whole.dot(normal) * whole).norm());
  }
  return most_mm;
}

/// Whether each slice reaches to the next; not where they do not say how thick they are.
bool touch(const std::vector<DicomSlice>& slices, const std::vector<double>& steps) {
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (steps[i] > 1.02 * std::max(slices[i].thickness_mm, slices[i + 1].thickness_mm) + 0.01) return false;
  }
  return true;
}

}  // namespace

SliceStack stack_slices(std::vector<DicomSlice> slices, const SliceName& name) {
  SliceStack stack;
  const Eigen::Vector3d normal = slices.front().row.cross(slices.front().column).normalized();
  std::stable_sort(slices.begin(), slices.end(), [&](const DicomSlice& a, const DicomSlice& b) {
    return a.position_mm.dot(normal) < b.position_mm.dot(normal);
  });
  stack.slices = std::move(slices);
  const auto& s = stack.slices;
  if (s.size() == 1) {
    stack.step_mm = s.front().thickness_mm > 0 ? s.front().thickness_mm : 1.0;
    return stack;
  }
  std::vector<double> steps;
  for (std::size_t i = 1; i < s.size(); ++i) {
    steps.push_back(s[i].position_mm.dot(normal) - s[i - 1].position_mm.dot(normal));
    if (steps.back() < 0.01) {
      stack.doubled = true;
      stack.problem =
          fmt::format("{} and {} lie at the same place; remove the doubled slices", name(s[i - 1]), name(s[i]));
      return stack;
    }
  }
  stack.step_mm = (s.back().position_mm - s.front().position_mm).dot(normal) / static_cast<double>(s.size() - 1);
  stack.tilt_deg = tilt_of(s, normal);
  if (const double beside_mm = beside_line_mm(s, normal);
      stack.tilt_deg > 0 && beside_mm > 0.5 * s.front().spacing_mm.minCoeff()) {
    stack.tilt_deg = 0;
    stack.problem = fmt::format(
        "its slices are shifted sideways unevenly, one of them by {:.2f} mm from the line of the first and the last: a "
        "tilted gantry shifts all alike; export the whole series again",
        beside_mm);
    return stack;
  }
  // Against the median, which a hole does not move.
  const double usual = median_of(steps);
  const auto worst = std::max_element(steps.begin(), steps.end(),
                                      [&](double a, double b) { return std::abs(a - usual) < std::abs(b - usual); });
  if (std::abs(*worst - usual) > 0.02 * usual + 0.01) {
    const auto at = static_cast<std::size_t>(worst - steps.begin());
    if (touch(s, steps)) stack.usual_step_mm = usual;
    stack.problem = fmt::format(
        "the step from {} to {} is {:.2f} mm where {:.2f} is usual: slices are missing or unevenly spaced; export the "
        "whole series",
        name(s[at]), name(s[at + 1]), *worst, usual);
  }
  return stack;
}

std::string why_no_volume(const SliceStack& stack, bool untilt) {
  if (stack.tilt_deg > 0 && !stack.doubled && !untilt) {
    return fmt::format(
        "the gantry was tilted by {:.1f} degrees, so the slices do not stack straight; --untilt resamples them",
        stack.tilt_deg);
  }
  const bool evened_out = untilt && stack.tilt_deg > 0 && stack.usual_step_mm > 0;
  return evened_out ? std::string() : stack.problem;
}

}  // namespace birdseye::host
