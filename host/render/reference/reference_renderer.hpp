#pragma once

#include <vector>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "host/deform/displacement_field.hpp"
#include "host/render/scene/scene.hpp"
#include "host/render/scene/transfer_function.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// docs/image-formation.md in double precision, one formula after the other, with nothing skipped and no early end.
/// Premultiplied RGBA in [0, 1], four doubles a pixel; of every `stride`th pixel of every `stride`th row, from (0, 0).
std::vector<double> render_reference(const Volume& scan, const TransferFunction& transfer, const CameraModel& camera,
                                     const Transform<Camera, Patient>& camera_from_patient,
                                     const RenderSettings& settings, const DisplacementField* deformation = nullptr,
                                     int stride = 1);

}  // namespace birdseye::host
