#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "calibration/base/image_view.hpp"
#include "calibration/base/result.hpp"

namespace birdseye::host {

/// The bright field of a rod lens in its dark surround: an ellipse along the picture's axes, for pixels need not be
/// square.
struct LensField {
  double centre_x_px = 0, centre_y_px = 0, radius_x_px = 0, radius_y_px = 0;
};

/// Finds the lens field. Empty where there is no dark surround with the edge of a round field, whole or cut by the
/// picture's border, at least 0.8 of the picture's shorter side across. Dark parts inside the field do not matter, nor
/// does a little light outside. A round organ of that size before black is mistaken for a field.
std::optional<LensField> find_lens_field(const RgbView& video);

/// Where a video picture can be compared with a synthetic one, not zero: inside the lens field, if there is one; not in
/// or close by saturated highlights; and where instruments, if given, is zero. Errc::bad_value for spans of another
/// size, Errc::degenerate where nothing is left.
Result<std::vector<std::uint8_t>> overlap_mask(const RgbView& video, std::span<const std::uint8_t> instruments = {});

}  // namespace birdseye::host
