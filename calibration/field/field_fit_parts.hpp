#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/field/field_fit.hpp"
#include "calibration/field/field_regression.hpp"

/// What the fit to known places and the fit to pairs share.
namespace birdseye::calibration::detail {

inline constexpr double kOutlierSigmas = 4.5;
// A tracker repeats itself to 1.8 mm. While the kind of map is not yet chosen, a larger error may be the map's fault.
inline constexpr double kLeastOutlierMm = 2, kLeastOutlierAtFirstMm = 5;
inline constexpr double kThinnestBoxMm = 100;  // a thinner one says nothing about the third direction

/// The box around places; an error where they are too thin to map, along the tracker's axes or their own.
Result<FieldFunctions> box_of(std::span<const Eigen::Vector3d> places_mm);

/// The families and orders to try, given how many measurements there are and how many parameters are allowed.
std::vector<FieldFunctions> families(const FieldFunctions& box, std::span<const Eigen::Vector3d> places_mm,
                                     const std::optional<FieldBasis>& only, std::size_t most_functions);

/// The best by held-out error; within 2 % of it the one with the fewest functions. Index into candidates.
std::size_t best_of(std::span<const FieldCandidate> candidates, std::span<const FieldFunctions> functions);

/// Which measurements are too far off to belong to the rest: by more than kOutlierSigmas robust sigmas (the median
/// distance in space is 1.538 of them) and by more than least_mm, for what a map does not quite follow is no mistake of
/// the measurement.
std::vector<bool> far_off(std::span<const Eigen::Vector3d> errors_mm, const std::vector<bool>& used, double least_mm);

double rms(std::span<const Eigen::Vector3d> errors, const std::vector<bool>& used);
/// Fills before and held-out figures from the residuals.
void sum_up(FieldFit& fit);
/// "cm" for 10 of them in one, where mm were taken for granted; nothing where the factor is no unit's.
std::string unit_of(double mm_per_unit);
/// How much of the box around the places, along their own axes, the map has, and how sure it is there.
void take_mapped(std::span<const Eigen::Vector3d> places_mm, FieldFit& fit);

}  // namespace birdseye::calibration::detail
