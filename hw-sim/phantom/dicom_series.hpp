#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "calibration/base/result.hpp"
#include "hw-sim/phantom/grid.hpp"

namespace birdseye::hw_sim {

/// Writes hu as a CT series of one file per slice into folder (made, or rid of a former series' files), with
/// identifiers that follow from seed alone. gantry_tilt_deg moves each slice on along y, as a tilted gantry does: such
/// a series must not be stacked straight.
Result<void> write_dicom_series(const std::filesystem::path& folder, const Grid& grid, std::span<const std::int16_t> hu,
                                std::uint64_t seed, double gantry_tilt_deg = 0);

/// Whether all that is in folder are slices that write_dicom_series() wrote, the last of them perhaps not to its end.
bool only_slices_of_ours(const std::filesystem::path& folder);

}  // namespace birdseye::hw_sim
