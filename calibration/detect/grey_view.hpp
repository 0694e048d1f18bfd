#pragma once

#include <cstddef>
#include <cstdint>

namespace birdseye::calibration {

/// A grey picture somewhere in memory.
struct GreyView {
  const std::uint8_t* data = nullptr;
  int width_px = 0, height_px = 0;
  std::size_t stride = 0;  ///< bytes from row to row
};

}  // namespace birdseye::calibration
