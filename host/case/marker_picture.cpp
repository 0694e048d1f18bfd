#include "host/case/marker_picture.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <string>

#include "host/report/slice_picture.hpp"

namespace birdseye::host {

Picture draw_markers(const Volume& ct, const FoundMarkers& found, double width_mm) {
  using Eigen::Vector3d;
  constexpr int kTile_px = 150, kOverview_px = 600, kColumns = 2;
  constexpr Colour kFound{86, 180, 233}, kDoubtful{230, 159, 0}, kText{255, 255, 255};
  const Vector3d last(ct.size[0] - 1, ct.size[1] - 1, ct.size[2] - 1);
  const Vector3d centre = ct.patient_from_voxel * Vector3d(0.5 * last);
  const Vector3d extent = (ct.patient_from_voxel.linear() * last.asDiagonal()).cwiseAbs().rowwise().sum();
  const double wide_mm = std::max(extent.x(), extent.z()) * 1.05;
  const SlicePlane front = slice_plane(SliceKind::coronal, centre, wide_mm, kOverview_px, kOverview_px);
  Picture overview = draw_brightest(ct, front, 0.5 * extent.y(), -200, 2000);
  draw_text(overview, {8, 18}, "from the front, brightest in depth", kText);

  const auto count = static_cast<int>(found.markers.size() + found.doubtful.size());
  const int rows = std::max(1, (count + kColumns - 1) / kColumns);
  Picture out{kOverview_px + 3 * kColumns * kTile_px, std::max(kOverview_px, rows * kTile_px), {}};
  out.rgb.resize(static_cast<std::size_t>(out.width_px) * static_cast<std::size_t>(out.height_px) * 3);
  int cell = 0;
  const auto show = [&](const Vector3d& at_mm, const std::string& name, double high_hu, const Colour& colour) {
    draw_cross_hair(overview, front.px_of(at_mm), 10, colour);
    draw_text(overview, front.px_of(at_mm) + Eigen::Vector2d(8, -6), name, colour);
    const ThreePlanes planes(at_mm, width_mm, kTile_px);
    Picture slices = planes.draw(ct, -200, high_hu);
    planes.mark(slices, at_mm, colour);
    draw_text(slices, {6, 18}, name, colour);
    paste(out, slices, kOverview_px + cell % kColumns * 3 * kTile_px, cell / kColumns * kTile_px);
    ++cell;
  };
  for (std::size_t i = 0; i < found.markers.size(); ++i)
    show(found.markers[i].centre_in_patient_mm, std::to_string(i + 1), found.markers[i].hu, kFound);
  for (const DoubtfulMarker& d : found.doubtful) show(d.centre_in_patient_mm, "?", 2000, kDoubtful);
  paste(out, overview, 0, 0);
  return out;
}

}  // namespace birdseye::host
