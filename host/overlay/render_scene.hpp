#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "host/deform/displacement_field.hpp"
#include "host/files/picture.hpp"
#include "host/overlay/frame_painter.hpp"
#include "host/overlay/margins.hpp"
#include "host/overlay/undistortion.hpp"
#include "host/render/engine.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// What `birdseye render` draws, once all is read.
struct RenderScene {
  Volume volume;
  std::optional<Margins> margins;  ///< as deformation, where there is one, has them
  std::optional<DisplacementField> deformation;
  CameraModel camera;
  Transform<Camera, Patient> camera_from_patient;
  RenderSettings settings;
  std::vector<Transform<Camera, Patient>> path;  ///< that a film goes along; may be none
  double film_s = 4;
  Picture behind;                              ///< of the camera's size: a frame of video, or black
  std::optional<FrameUndistorter> straighten;  ///< where the camera is a straight one in place of that of the video
};

/// Without lens and pose: from in front of the patient, head up; of a scan thinner than half its height or width, from
/// the feet as radiologists look at a slice. The volume fills the picture; what lies before share `clip` of its depth
/// is cut away. size: WIDTHxHEIGHT.
Result<void> look_from_the_front(RenderScene& scene, const std::string& size, double clip);

/// The middle of the volume's box, patient frame.
Eigen::Vector3d middle_of(const Volume& volume);

/// The scene from here over what is behind it, with a look of its own. Lens and pose are somebody's files.
PaintedStill draw(Engine& engine, const RenderScene& scene, const Transform<Camera, Patient>& camera_from_patient,
                  const OverlayLook& look);

/// With a path the camera goes along it, from the first pose in the first frame to the last in the last. Without, and
/// with a deformation: it grows from nothing and goes back. Without both the camera swings about the volume's middle.
Result<void> film_scene(const std::filesystem::path& path, const RenderScene& scene, Engine& engine);

}  // namespace birdseye::host
