#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/registration/rigid/fiducial_judgement.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Refuses a file of markers in which two lie under 1 mm apart, for one marker counts as one. names: one for each, or
/// none. Points that all lie within a few mm of each other are left to who looks at their unit.
Result<void> refuse_doubles(const std::filesystem::path& file, std::span<const Eigen::Vector3d> points_mm,
                            const std::vector<std::string>& names);

/// Refuses markers of the CT and touches that are alike to the last digit: one file was given in the other's place.
Result<void> refuse_one_file_twice(const std::filesystem::path& ct, const std::filesystem::path& tracker,
                                   std::span<const Eigen::Vector3d> ct_mm, std::span<const Eigen::Vector3d> touched_mm);

/// At how many of the places the CT shows a marker.
struct MarkersSeen {
  std::size_t places = 0;
  std::size_t as_given = 0, turned = 0;  ///< turned: with the other sign of x and y, as RAS has them
  bool turned_inside = false;            ///< the CT's patient is at all places, turned
  /// Most are shown turned, and few as given; or none as given, and turned two or more, a quarter at least: by chance
  /// the CT shows something like a marker at one place, hardly at two.
  [[nodiscard]] bool only_turned() const {
    return (4 * turned >= 3 * places && 4 * as_given <= places) ||
           (as_given == 0 && turned >= 2 && 4 * turned >= places);
  }
  [[nodiscard]] bool none() const { return as_given == 0 && !only_turned(); }
};

/// Looks for a marker of a usual kind at each place, and where few are, at the places turned. Nothing of more places
/// than anyone touches.
std::optional<MarkersSeen> look_for_markers(const Volume& ct, std::span<const Eigen::Vector3d> places_mm);

/// Root mean square distance of points from their middle.
double spread_mm(std::span<const Eigen::Vector3d> points_mm);

/// What a ratio of lengths, CT over touched, looks like, and what to do about it.
std::string scale_advice(double scale);

/// The same where lengths along one axis of the CT alone are off.
std::string axis_scale_advice();

/// What to do where the points do not fit one another, by their shapes.
std::string misfit_advice(std::span<const Eigen::Vector3d> ct_mm, std::span<const Eigen::Vector3d> touched_mm,
                          const FiducialJudgement& judged);

}  // namespace birdseye::host
