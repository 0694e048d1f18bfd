#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/render/scene/scene.hpp"
#include "host/render/scene/transfer_function.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// How many voxels of a volume there are of each HU, as a chart shows it: square roots, the largest 1.
class HuHistogram {
 public:
  static constexpr double kLowestHu = -250, kHighestHu = 650;
  static constexpr std::size_t kBins = 128;

  HuHistogram() = default;
  explicit HuHistogram(const Volume& volume);
  [[nodiscard]] const std::vector<float>& heights() const { return heights_; }

 private:
  std::vector<float> heights_ = std::vector<float>(kBins, 0.0F);
};

/// Across one axis of the patient, at a part of the volume's extent; what lies behind it, or below, or to the left, is
/// kept.
struct CuttingPlane {
  int axis = 1;       ///< 0 left to right, 1 front to back, 2 feet to head
  double part = 0.5;  ///< of the extent, in [0, 1]
};
ClipPlane clip_plane(const CuttingPlane& plane, const Volume& volume);

/// The points of a transfer function over a histogram, to be dragged, coloured and replaced by presets.
class TransferEditor {
 public:
  void set_points(std::vector<TransferPoint> points);
  /// Draws into the present ImGui window. The points, once a person has changed them and let go.
  std::optional<std::vector<TransferPoint>> draw(const HuHistogram& histogram, float scale);

 private:
  std::vector<TransferPoint> points_;
  std::size_t chosen_ = 0;
  bool dragged_ = false;
};

}  // namespace birdseye::host
