#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "host/deform/displacement_field.hpp"
#include "host/render/gl/gl_context.hpp"
#include "host/render/gl/gl_objects.hpp"
#include "host/render/scene/scene.hpp"
#include "host/render/scene/seen_bricks.hpp"
#include "host/render/scene/transfer_function.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// The paper's own method (section 3): slices of the volume along the axis that the camera looks along most, drawn from
/// back to front as textured patches. A patch stands still; its texture moves. Each patch is tessellated so that its
/// polygons are planar in the texture too, lit by an affine map of its own (Equation 3), and left out where the
/// interval of its grey values holds nothing that is seen. Samples lie a slice apart, not a step: the picture is
/// coarser than RayCaster's.
class GlSliceRenderer {
 public:
  /// Keeps references to context, which must be current whenever this is used, and to volume.
  static Result<std::unique_ptr<GlSliceRenderer>> create(GlContext& context, const Volume& volume,
                                                         const TransferFunction& transfer, bool prune = true);
  void deform(const DisplacementField& field);
  void undeform();
  [[nodiscard]] ImageRgba render(const CameraModel& camera, const Transform<Camera, Patient>& camera_from_patient,
                                 const RenderSettings& settings);

 private:
  struct Slices {
    std::vector<GLuint> first, count;  ///< of each slice's indices
    GlBuffer vertices, indices;
    GlVertexArray array;
  };
  GlSliceRenderer(const Volume& volume, const TransferFunction& transfer, bool prune)
      : volume_(volume), transfer_(transfer), seen_(volume, transfer_), prune_(prune) {}
  void measure_moves(const DisplacementField* field);
  [[nodiscard]] const Slices& slices_along(int axis);

  const Volume& volume_;
  TransferFunction transfer_;
  SeenBricks seen_;
  bool prune_;
  GlProgram draw_;
  GlTexture hu_, gradient_, target_, transfer_table_;
  GlFramebuffer framebuffer_;
  GlBuffer affine_;
  std::vector<Eigen::Vector3f> moves_;  ///< at kCells + 1 points along each axis, voxels
  std::array<std::optional<Slices>, 3> slices_;
  int width_px_ = 0, height_px_ = 0;
  CameraModel folded_;  ///< the lens whose fold is in fold_, kept because finding it takes a while
  double fold_ = 0;
};

}  // namespace birdseye::host
