#include "host/window/inset_view.hpp"

#include <gtest/gtest.h>

namespace birdseye::host {
namespace {

/// Shows nothing of the volume.
ImageRgba empty(const CameraModel& camera) {
  const auto pixels = static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
  return {camera.width_px, camera.height_px, std::vector<std::uint8_t>(4 * pixels, 0)};
}

Volume body() {
  Volume volume;
  volume.size = {40, 40, 40};
  volume.spacing_mm = {10, 10, 10};
  volume.patient_from_voxel = Eigen::Translation3d(-195, -195, -195) * Eigen::Scaling(10.0, 10.0, 10.0);
  return volume;
}

std::size_t bright(const Picture& picture) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < picture.rgb.size(); i += 3) count += picture.rgb[i] > 120 ? 1 : 0;
  return count;
}

TEST(InsetView, ShowsTheScopeWhereItIsKnown) {
  const InsetView inset(body());
  const ImageRgba ct = empty(inset.camera());
  EXPECT_EQ(bright(inset.draw(ct, std::nullopt)), 0U);
  // In front of the patient (-y), looking to the back (+y).
  Eigen::Matrix3d camera_from_patient;
  camera_from_patient << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const Transform<Camera, Patient> pose(camera_from_patient, -camera_from_patient * Eigen::Vector3d(0, -120, 0));
  const Picture seen = inset.draw(ct, pose);
  EXPECT_GT(bright(seen), 100U);
  EXPECT_EQ(seen.width_px, InsetView::kWidthPx);
}

}  // namespace
}  // namespace birdseye::host
