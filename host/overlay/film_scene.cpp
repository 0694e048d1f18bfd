#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calibration/geometry/camera_path.hpp"
#include "drivers/system/interrupt.hpp"
#include "drivers/system/progress.hpp"
#include "host/files/film.hpp"
#include "host/overlay/render_scene.hpp"

namespace birdseye::host {

Result<void> film_scene(const std::filesystem::path& path, const RenderScene& scene, Engine& engine) {
  constexpr double kRate_hz = 25, kSwing_rad = 0.6;
  const int frames = std::max(2, static_cast<int>(std::lround(scene.film_s * kRate_hz)));
  auto film = Film::open(path, scene.camera.width_px, scene.camera.height_px, kRate_hz);
  if (!film) return film.error();
  const Eigen::Vector3d middle = middle_of(scene.volume);
  OverlayLook look;
  look.render = scene.settings;
  Progress progress;
  for (int frame = 0; frame < frames; ++frame) {
    if (interrupted()) return Error{Errc::disconnected, "interrupted; no film is written"};
    if (frame % 10 == 0) progress(fmt::format("frame {} of {}", frame, frames));
    const double phase = 2 * std::numbers::pi * frame / frames;
    Transform<Camera, Patient> camera_from_patient = scene.camera_from_patient;
    if (!scene.path.empty()) {
      const double share = static_cast<double>(frame) / (frames - 1);
      camera_from_patient = camera_along(scene.path, share * static_cast<double>(scene.path.size() - 1));
    } else if (scene.deformation) {
      DisplacementField part = *scene.deformation;
      const auto share = static_cast<float>(0.5 - 0.5 * std::cos(phase));
      for (Eigen::Vector3f& u : part.displacement_mm) u *= share;
      engine.deform(part);
    } else {
      const Eigen::Vector3d down = scene.camera_from_patient.rotation().transpose().col(1);
      const Eigen::Matrix3d turn = rotation_exp(kSwing_rad * std::sin(phase) * down);
      camera_from_patient =
          scene.camera_from_patient * Transform<Patient, Patient>(turn, Eigen::Vector3d(middle - turn * middle));
    }
    if (auto added = film->add(draw(engine, scene, camera_from_patient, look).rgb); !added) return added;
  }
  progress.keep(path.string());
  return film->finish();
}

}  // namespace birdseye::host
