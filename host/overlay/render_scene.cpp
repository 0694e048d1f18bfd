#include "host/overlay/render_scene.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "calibration/base/picture_size.hpp"
#include "host/volume/patient_box.hpp"

namespace birdseye::host {

Eigen::Vector3d middle_of(const Volume& volume) {
  return patient_box(volume).middle_mm();
}

Result<void> look_from_the_front(RenderScene& scene, const std::string& size, double clip) {
  CameraModel& c = scene.camera;
  const auto picture = parse_picture_size(size);
  if (!picture || std::min(picture->width_px, picture->height_px) < 16 ||
      std::max(picture->width_px, picture->height_px) > 8192)
    return Error{Errc::bad_value, fmt::format("--size {}: give WIDTHxHEIGHT of 16 to 8192 pixels", size)};
  c.width_px = picture->width_px;
  c.height_px = picture->height_px;
  const auto [low, high] = patient_box(scene.volume);
  const Eigen::Vector3d extent = high - low;
  const bool thin = 2 * extent.z() < std::min(extent.x(), extent.y());
  const Eigen::Vector3d right = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d down =
      thin ? Eigen::Vector3d(Eigen::Vector3d::UnitY()) : Eigen::Vector3d(-Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d forward = right.cross(down);
  const double wide = extent.x();
  const double tall = extent.dot(down.cwiseAbs());
  const double deep = extent.dot(forward);
  const double distance = 2.5 * std::max(wide, tall);
  const Eigen::Vector3d middle = 0.5 * (low + high);
  const Eigen::Vector3d eye = middle - (0.5 * deep + distance) * forward;
  c.fx_px = c.fy_px = 0.96 * (distance + clip * deep) * std::min(c.width_px / wide, c.height_px / tall);
  c.cx_px = 0.5 * (c.width_px - 1);
  c.cy_px = 0.5 * (c.height_px - 1);
  Eigen::Matrix3d patient_from_camera;
  patient_from_camera << right, down, forward;
  scene.camera_from_patient = Transform<Patient, Camera>(patient_from_camera, eye).inverse();
  if (clip > 0) scene.settings.clip = ClipPlane{forward, low.dot(forward) + clip * deep};
  return {};
}

PaintedStill draw(Engine& engine, const RenderScene& scene, const Transform<Camera, Patient>& camera_from_patient,
                  const OverlayLook& look) {
  const Still still{scene.behind.rgb, scene.camera, camera_from_patient,
                    scene.straighten ? &*scene.straighten : nullptr, scene.margins ? &*scene.margins : nullptr};
  return paint_still(still, engine, look, vouched_for({}));
}

}  // namespace birdseye::host
