#pragma once

#include <memory>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "host/deform/displacement_field.hpp"
#include "host/render/gl/gl_context.hpp"
#include "host/render/gl/gl_objects.hpp"
#include "host/render/scene/scene.hpp"
#include "host/render/scene/transfer_function.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Draws RayCaster's picture on the graphics card, which does all the work: resampling, light, bricks, rays.
class GlRayCaster {
 public:
  /// Keeps references to context, which must be current whenever this is used, and to volume.
  static Result<std::unique_ptr<GlRayCaster>> create(GlContext& context, const Volume& volume,
                                                     const TransferFunction& transfer, bool prune = true);
  void deform(const DisplacementField& field);
  void undeform();
  [[nodiscard]] ImageRgba render(const CameraModel& camera, const Transform<Camera, Patient>& camera_from_patient,
                                 const RenderSettings& settings);

 private:
  GlRayCaster(const Volume& volume, const TransferFunction& transfer) : volume_(volume), transfer_(transfer) {}
  void find_bricks();
  void prepare(const CameraModel& camera);

  const Volume& volume_;
  TransferFunction transfer_;
  GlProgram warp_, light_, seen_, grow_, cast_;
  GlTexture scan_hu_, warped_hu_, lit_, bricks_[2], directions_, target_, transfer_table_;
  GlBuffer seen_up_to_;
  GlFramebuffer framebuffer_;
  GlVertexArray no_vertices_;
  bool deformed_ = false;
  CameraModel prepared_;
};

}  // namespace birdseye::host
