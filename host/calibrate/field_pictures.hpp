#pragma once

#include <string>
#include <vector>

#include "calibration/field/field_check.hpp"
#include "calibration/field/field_fit.hpp"

namespace birdseye::host {

/// Slices through the volume, across z: an arrow for each measurement, drawn up to ten times as long as it is. On the
/// left it leads from the true place to the measured one, on the right to where a map puts it that was not shown its
/// region. Grey: where the field is not mapped. Outliers are crosses.
std::string field_arrows_svg(const calibration::FieldFit& fit);

/// The held-out error of all kinds of map, as bars; the chosen one is dark.
std::string field_candidates_svg(const calibration::FieldFit& fit);

/// The days of a history, with mean and control limits; days beyond 3 sigma are marked.
std::string field_chart_svg(const std::vector<calibration::FieldCheck>& history);

}  // namespace birdseye::host
