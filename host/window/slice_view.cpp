#include "host/window/slice_view.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace birdseye::host {

namespace {

constexpr std::array<SliceKind, SliceView::kViews> kKinds{SliceKind::axial, SliceKind::coronal, SliceKind::sagittal};
/// The patient's axis that each kind of slice is cut across.
constexpr std::array<int, SliceView::kViews> kAcross{2, 1, 0};
/// What lies at the left, right, upper and lower edge: the patient's right and left, front and back, head and feet.
constexpr std::array<std::array<const char*, 4>, SliceView::kViews> kEdges{
    {{"R", "L", "A", "P"}, {"R", "L", "H", "F"}, {"A", "P", "H", "F"}}};
constexpr Colour kHair{86, 180, 233}, kLetters{200, 205, 210};
constexpr double kShownWithin_mm = 4;

}  // namespace

SliceView::SliceView(std::shared_ptr<const Volume> ct)
    : ct_(std::move(ct)), box_(patient_box(*ct_)), place_mm_(box_.middle_mm()) {}

void SliceView::go_to(const Eigen::Vector3d& place_in_patient_mm) {
  if (place_in_patient_mm.allFinite()) place_mm_ = place_in_patient_mm.cwiseMax(box_.low_mm).cwiseMin(box_.high_mm);
}

void SliceView::scroll(int view, double notches) {
  const int axis = kAcross[static_cast<std::size_t>(view)];
  Eigen::Vector3d to_mm = place_mm_;
  // Of the voxels' axes the one that goes that way: slices follow one another at its spacing.
  Eigen::Index along = 0;
  ct_->patient_from_voxel.linear().row(axis).cwiseAbs().maxCoeff(&along);
  to_mm[axis] += notches * ct_->spacing_mm[along];
  go_to(to_mm);
}

void SliceView::set_zoom(double zoom) {
  zoom_ = std::clamp(zoom, 1.0, kMostZoom);
}

std::optional<int> SliceView::hu() const {
  const Eigen::Vector3d voxel = ct_->patient_from_voxel.inverse() * place_mm_;
  const Eigen::Array3i at = (voxel.array() + 0.5).floor().cast<int>();
  if ((at < 0).any() || (at >= Eigen::Array3i(ct_->size[0], ct_->size[1], ct_->size[2])).any()) return std::nullopt;
  return ct_->at(at.x(), at.y(), at.z());
}

SlicePlane SliceView::plane(int view) const {
  const Eigen::Vector3d middle_mm = box_.middle_mm();
  // The nearer it is looked at, the more the place is in the middle; it stays where it is on the screen.
  Eigen::Vector3d centre_mm = middle_mm + (1 - 1 / zoom_) * (place_mm_ - middle_mm);
  const int axis = kAcross[static_cast<std::size_t>(view)];
  centre_mm[axis] = place_mm_[axis];
  constexpr double kAround = 1.04;
  const double width_mm = kAround * (box_.high_mm - box_.low_mm).maxCoeff() / zoom_;
  return slice_plane(kKinds[static_cast<std::size_t>(view)], centre_mm, width_mm, kSidePx, kSidePx);
}

int SliceView::view_at(const Eigen::Vector2d& px) {
  return std::clamp(static_cast<int>(px.x() / kSidePx), 0, kViews - 1);
}

Eigen::Vector3d SliceView::place_at(const Eigen::Vector2d& px) const {
  const int view = view_at(px);
  return plane(view).at(px.x() - view * kSidePx, px.y());
}

Eigen::Vector2d SliceView::px_of(int view, const Eigen::Vector3d& place_in_patient_mm) const {
  return plane(view).px_of(place_in_patient_mm) + Eigen::Vector2d(view * kSidePx, 0);
}

Picture SliceView::draw(const std::vector<SliceMark>& marks) const {
  Picture out{kWidthPx, kHeightPx, std::vector<std::uint8_t>(std::size_t{3} * kWidthPx * kHeightPx)};
  for (int view = 0; view < kViews; ++view) {
    const SlicePlane here = plane(view);
    Picture slice = draw_slice(*ct_, here, window_.low, window_.high);
    const int axis = kAcross[static_cast<std::size_t>(view)];
    for (const SliceMark& mark : marks) {
      if (std::abs(mark.place_mm[axis] - place_mm_[axis]) > kShownWithin_mm) continue;
      draw_cross_hair(slice, here.px_of(mark.place_mm), 9, mark.colour);
      draw_text(slice, here.px_of(mark.place_mm) + Eigen::Vector2d(8, -8), mark.name, mark.colour);
    }
    draw_cross_hair(slice, here.px_of(place_mm_), kSidePx, kHair, 0.03);
    const auto& edges = kEdges[static_cast<std::size_t>(view)];
    constexpr double kMiddle = 0.5 * kSidePx;
    draw_text(slice, {8, kMiddle}, edges[0], kLetters);
    draw_text(slice, {kSidePx - 24, kMiddle}, edges[1], kLetters);
    draw_text(slice, {kMiddle, 16}, edges[2], kLetters);
    draw_text(slice, {kMiddle, kSidePx - 6}, edges[3], kLetters);
    paste(out, slice, view * kSidePx, 0);
  }
  return out;
}

}  // namespace birdseye::host
