#include "host/window/show_scene.hpp"

#include <fmt/format.h>

#include "drivers/system/interrupt.hpp"
#include "host/render/scene/scene.hpp"
#include "host/window/orbit.hpp"

namespace birdseye::host {

Result<Picture> show_scene(Window& window, const RenderScene& scene, Engine& engine, int most_pictures) {
  note_interrupts();
  const Eigen::Vector3d middle = middle_of(scene.volume);
  Transform<Camera, Patient> camera_from_patient = scene.camera_from_patient;
  OverlayLook look;
  look.render = scene.settings;
  bool deformed = scene.deformation.has_value();
  bool changed = true;
  for (int pictures = 0; !window.closed() && !interrupted();) {
    if (changed || most_pictures > 0) {
      window.show(draw(engine, scene, camera_from_patient, look).rgb);
      if (!window.fault().empty()) return Error{Errc::io, "window: " + window.fault() + "; use --engine cpu"};
      if (++pictures == most_pictures) break;
    }
    const WindowInput input = window.wait(Duration::from_ms(most_pictures > 0 ? 1 : 200));
    changed = input.dragged_x_px != 0 || input.dragged_y_px != 0 || input.wheel != 0 || !input.keys.empty();
    camera_from_patient = orbited(scene.camera, camera_from_patient, middle, input.dragged_x_px, input.dragged_y_px);
    if (input.wheel != 0) camera_from_patient = approached(camera_from_patient, middle, input.wheel);
    for (const char key : input.keys) {
      if (key == 'R') camera_from_patient = scene.camera_from_patient;
      if (key == 'C') look.render.clip = look.render.clip ? std::nullopt : scene.settings.clip;
      if (key == 'D' && scene.deformation) {
        deformed = !deformed;
        deformed ? engine.deform(*scene.deformation) : engine.undeform();
      }
    }
  }
  const ImageRgba last = window.read_back();
  if (!window.fault().empty()) return Error{Errc::io, "window: " + window.fault() + "; use --engine cpu"};
  return Picture{last.width_px, last.height_px, on_grey(last, 0)};
}

}  // namespace birdseye::host
