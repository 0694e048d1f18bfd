#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/files/picture.hpp"
#include "host/report/slice_picture.hpp"
#include "host/volume/patient_box.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// A place of the CT that the slices mark.
struct SliceMark {
  Eigen::Vector3d place_mm;  ///< patient frame
  std::string name;
  std::array<std::uint8_t, 3> colour;
  bool operator==(const SliceMark&) const = default;
};

/// The HU from black to white.
struct HuWindow {
  double low = -160, high = 240;
  bool operator==(const HuWindow&) const = default;
};
inline constexpr HuWindow kSoftTissue{-160, 240}, kBoneAndMarkers{-500, 1500};

/// Three slices of a CT through one place, side by side in one picture: axial, coronal, sagittal. A cross-hair in each
/// shows where the others cut.
class SliceView {
 public:
  static constexpr int kViews = 3, kSidePx = 420;
  static constexpr int kWidthPx = kViews * kSidePx, kHeightPx = kSidePx;
  static constexpr double kMostZoom = 8;

  /// Looks at the CT's middle.
  explicit SliceView(std::shared_ptr<const Volume> ct);

  [[nodiscard]] const Eigen::Vector3d& place_mm() const { return place_mm_; }
  /// Kept within the CT's box.
  void go_to(const Eigen::Vector3d& place_in_patient_mm);
  /// Through the slices of one of the three views; a notch is a voxel along the patient's axis.
  void scroll(int view, double notches);
  void set_zoom(double zoom);
  void set_window(const HuWindow& window) { window_ = window; }
  [[nodiscard]] double zoom() const { return zoom_; }
  [[nodiscard]] const HuWindow& window() const { return window_; }
  /// At the cross-hair; empty outside of the CT.
  [[nodiscard]] std::optional<int> hu() const;

  /// The place under a pixel of the picture.
  [[nodiscard]] Eigen::Vector3d place_at(const Eigen::Vector2d& px) const;
  /// Where a place lies in one of the views, pixels of the picture; it may lie outside of the view.
  [[nodiscard]] Eigen::Vector2d px_of(int view, const Eigen::Vector3d& place_in_patient_mm) const;
  static int view_at(const Eigen::Vector2d& px);

  /// marks: those that lie within 4 mm of a slice are drawn in it.
  [[nodiscard]] Picture draw(const std::vector<SliceMark>& marks) const;

 private:
  [[nodiscard]] SlicePlane plane(int view) const;

  std::shared_ptr<const Volume> ct_;
  PatientBox box_;
  Eigen::Vector3d place_mm_;
  double zoom_ = 1;
  HuWindow window_;
};

}  // namespace birdseye::host
