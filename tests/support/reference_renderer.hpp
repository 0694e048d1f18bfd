#pragma once

#include <vector>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "host/deform/displacement_field.hpp"
#include "host/render/scene.hpp"
#include "host/render/transfer_function.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::testing {

/// docs/image-formation.md in double precision, one formula after the other, with nothing skipped and no early end.
/// Premultiplied RGBA in [0, 1], four doubles a pixel.
std::vector<double> render_reference(const host::Volume& volume, const host::TransferFunction& transfer,
                                     const CameraModel& camera, const Transform<Camera, Patient>& camera_from_patient,
                                     const host::RenderSettings& settings,
                                     const host::DisplacementField* deformation = nullptr);

}  // namespace birdseye::testing
