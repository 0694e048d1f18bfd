#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "calibration/geometry/camera_model.hpp"
#include "host/render/scene/scene.hpp"

namespace birdseye::host {

/// What a straight picture keeps of the bent one that it is made from, both of one size.
enum class Kept {
  centre_scale,  ///< the scale at the lens's centre; a barrel-shaped picture loses its rim
  every_pixel,   ///< every pixel that the lens sees, up to kWidestTangent; smaller, with black corners
};

/// A lens without distortion for the picture of one with: of the same size and the same shape of pixels.
CameraModel pinhole_for(const CameraModel& camera, Kept kept);

/// Resamples the frames of one camera as another at the same place would have taken them: straight lines straight,
/// where that other is a pinhole. Bilinear; where the first camera does not see it is black. Where each pixel comes
/// from is found once, by OpenCV's way of keeping it (1/32 px), so that a frame takes about a millisecond.
class FrameUndistorter {
 public:
  FrameUndistorter(const CameraModel& from, const CameraModel& to);

  /// pixels: RGB, 8 bits, rows from the top, of the size of `from`; the answer is of the size of `to`. Pixels of
  /// another number than that belong to another camera: the answer is black.
  [[nodiscard]] std::vector<std::uint8_t> apply(std::span<const std::uint8_t> pixels) const;

  /// Makes transparent what `to` sees and `from` does not: an overlay has nothing to lie on there. Of the size of `to`;
  /// an overlay of another size stays as it is.
  void hide_unseen(ImageRgba& overlay) const;

  [[nodiscard]] const CameraModel& from() const { return from_; }
  [[nodiscard]] const CameraModel& to() const { return to_; }

 private:
  CameraModel from_, to_;
  std::vector<std::int16_t> where_;      ///< x, y of each pixel's upper left source
  std::vector<std::uint16_t> fraction_;  ///< between its four sources, 5 bits an axis
};

}  // namespace birdseye::host
