#include "host/case/fiducial_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/registration/rigid/points_in_ct.hpp"
#include "host/volume/marker_near.hpp"

namespace birdseye::host {

namespace {

using Places = std::span<const Eigen::Vector3d>;

/// A careless hand, or another program's rounding; a marker of another size than was looked for.
constexpr double kAtThePlace_mm = 5;

bool shows_marker(const Volume& ct, const Eigen::Vector3d& place_mm) {
  const auto found = find_marker_near(ct, place_mm);
  return found && (found->centre_in_patient_mm - place_mm).norm() <= kAtThePlace_mm;
}

}  // namespace

Result<void> refuse_doubles(const std::filesystem::path& file, Places points_mm,
                            const std::vector<std::string>& names) {
  constexpr double kOneMarker_mm = 1, kLeastReach_mm = 10;
  double reach_mm = 0;
  for (const Eigen::Vector3d& point : points_mm) reach_mm = std::max(reach_mm, (point - points_mm.front()).norm());
  if (reach_mm < kLeastReach_mm) return {};
  const auto name_of = [&](std::size_t i) { return names.empty() ? std::to_string(i + 1) : names[i]; };
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const double apart_mm = (points_mm[i] - points_mm[k]).norm();
      if (apart_mm >= kOneMarker_mm) continue;
      return Error{Errc::bad_value,
                   fmt::format("{}: points {} and {} are {:.2f} mm apart, and are one marker: take one of them out",
                               file.string(), name_of(k), name_of(i), apart_mm)};
    }
  }
  return {};
}

Result<void> refuse_one_file_twice(const std::filesystem::path& ct, const std::filesystem::path& tracker, Places ct_mm,
                                   Places touched_mm) {
  if (!std::ranges::equal(ct_mm, touched_mm)) return {};
  return Error{Errc::bad_value,
               fmt::format("{} and {}: hold the same points to the last digit: give the places in the CT as --ct, and "
                           "those that were touched as --tracker",
                           ct.string(), tracker.string())};
}

std::optional<MarkersSeen> look_for_markers(const Volume& ct, Places places_mm) {
  constexpr std::size_t kMostPlaces = 20;
  if (places_mm.size() > kMostPlaces) return std::nullopt;
  MarkersSeen seen;
  seen.places = places_mm.size();
  for (const Eigen::Vector3d& place_mm : places_mm) seen.as_given += shows_marker(ct, place_mm) ? 1 : 0;
  if (4 * seen.as_given > seen.places) return seen;
  std::vector<Eigen::Vector3d> turned_mm;
  for (const Eigen::Vector3d& place_mm : places_mm) turned_mm.emplace_back(-place_mm.x(), -place_mm.y(), place_mm.z());
  for (const Eigen::Vector3d& place_mm : turned_mm) seen.turned += shows_marker(ct, place_mm) ? 1 : 0;
  seen.turned_inside = points_outside(ct, turned_mm).empty();
  return seen;
}

double spread_mm(Places points_mm) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points_mm) middle += point / static_cast<double>(points_mm.size());
  double sum = 0;
  for (const Eigen::Vector3d& point : points_mm) sum += (point - middle).squaredNorm();
  return std::sqrt(sum / static_cast<double>(points_mm.size()));
}

std::string scale_advice(double scale) {
  const auto near = [&](double value) { return std::abs(scale / value - 1) < 0.1; };
  if (near(1000)) return "the touched points seem to be in metres: give mm";
  if (near(0.001)) return "the points of the CT seem to be in metres: give mm";
  if (near(10)) return "the touched points seem to be in cm: give mm";
  if (near(0.1)) return "the points of the CT seem to be in cm: give mm";
  if (near(25.4)) return "the touched points seem to be in inches: give mm";
  return "look at the CT's spacing: are its slices as far apart as the file says, and are the CT's points in mm of the "
         "patient, not in voxels? Is the tracker's scale right?";
}

std::string axis_scale_advice() {
  return "is the CT's spacing along this axis right, of a CT the distance of its slices? Import it again";
}

std::string misfit_advice(Places ct_mm, Places touched_mm, const FiducialJudgement& judged) {
  const double ratio = spread_mm(ct_mm) / spread_mm(touched_mm);
  if (ratio > 5 || ratio < 0.2) return scale_advice(ratio);
  if (judged.mirrored) {
    return "one of the two files is mirrored: one axis has the wrong sign, or two axes are exchanged (between 3D "
           "Slicer's RAS and LPS, two have the other sign: that mirrors nothing)";
  }
  if (judged.scale == Grade::fail && judged.along_axis) return axis_scale_advice();
  return "are the points in the same order? --match finds it";
}

}  // namespace birdseye::host
