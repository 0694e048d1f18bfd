#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// channels: 3 (RGB) or 4 (RGBA, not premultiplied), 8 bits, rows from the top. Appears under its name when it is
/// whole.
Result<void> write_png(const std::filesystem::path& path, std::span<const std::uint8_t> pixels, int width_px,
                       int height_px, int channels);

}  // namespace birdseye::host
