#pragma once

#include <Eigen/Core>
#include <array>
#include <string>

#include "host/files/picture.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// A plane through the patient, as a picture: where its pixels lie.
struct SlicePlane {
  Eigen::Vector3d centre_in_patient_mm;
  Eigen::Vector3d right, down;  ///< unit length, patient frame
  double mm_per_px = 1;
  int width_px = 0, height_px = 0;

  [[nodiscard]] Eigen::Vector3d at(double x_px, double y_px) const {
    return centre_in_patient_mm + mm_per_px * ((x_px - 0.5 * width_px) * right + (y_px - 0.5 * height_px) * down);
  }
  [[nodiscard]] Eigen::Vector2d px_of(const Eigen::Vector3d& point_in_patient_mm) const {
    const Eigen::Vector3d d = (point_in_patient_mm - centre_in_patient_mm) / mm_per_px;
    return {d.dot(right) + 0.5 * width_px, d.dot(down) + 0.5 * height_px};
  }
};

/// The three usual planes, as radiologists hang them: the patient's left at the picture's right, front or head up.
enum class SliceKind { axial, coronal, sagittal };
SlicePlane slice_plane(SliceKind kind, const Eigen::Vector3d& centre_in_patient_mm, double width_mm, int width_px,
                       int height_px);

/// Grey from low_hu to high_hu, interpolated; black outside of the CT.
Picture draw_slice(const Volume& ct, const SlicePlane& plane, double low_hu, double high_hu);
/// For each pixel the brightest value within depth_mm on either side of the plane.
Picture draw_brightest(const Volume& ct, const SlicePlane& plane, double depth_mm, double low_hu, double high_hu);

using Colour = std::array<std::uint8_t, 3>;
void draw_text(Picture& picture, const Eigen::Vector2d& at_px, const std::string& text, const Colour& colour);
/// A cross hair one pixel thin with its middle left open, so that it hides nothing. open: the part of the radius.
void draw_cross_hair(Picture& picture, const Eigen::Vector2d& centre_px, int radius_px, const Colour& colour,
                     double open = 0.25);

/// The axial, coronal and sagittal plane through a place, side by side.
class ThreePlanes {
 public:
  ThreePlanes(const Eigen::Vector3d& centre_in_patient_mm, double width_mm, int side_px);

  [[nodiscard]] Picture draw(const Volume& ct, double low_hu, double high_hu) const;
  /// A cross hair in each plane where it shows the place, in the plane or before or behind it.
  void mark(Picture& picture, const Eigen::Vector3d& place_in_patient_mm, const Colour& colour) const;

 private:
  int side_px_;
  std::array<SlicePlane, 3> planes_;
};

void paste(Picture& onto, const Picture& what, int x_px, int y_px);

}  // namespace birdseye::host
