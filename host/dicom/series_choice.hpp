#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/dicom/series.hpp"

namespace birdseye::host {

/// Which of the series `wanted` names: by id or UID, by number, by description, by phase, by part, or by words of the
/// description, whichever of these fits first. Where wanted is empty: the only one that is not passed over, or the only
/// one. Errc::not_found where none fits, Errc::unsupported where several do, with their names; no error names a path.
Result<std::size_t> choose_series(const std::vector<SeriesInfo>& series, const std::string& wanted);

/// "3 'portal venous 1.0'", for a message.
std::string series_name(const SeriesInfo& series);

}  // namespace birdseye::host
