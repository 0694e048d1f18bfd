#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/image_view.hpp"
#include "calibration/base/result.hpp"
#include "host/registration/geometry/texture_shifts.hpp"

namespace birdseye::host {

/// A view for a check: pinhole_view() of 640 to 1280 pixels across, for it must be done in a moment. Refuses what
/// overlap_mask() refuses.
Result<PinholeView> view_to_check(const CameraModel& camera, const Transform<Camera, Patient>& camera_from_patient,
                                  const RgbView& picture);

/// What a check is to expect where nothing has moved: standard deviations, mm.
struct CheckErrors {
  double surface_mm;  ///< of the deformed surface, along its normal
  double pose_mm;     ///< of where two views' poses have one place against each other, each axis
};

/// A place of the outline as the deformed surface has it against the picture.
struct OutlineShift {
  Eigen::Vector2d at_px;
  double outwards_mm;  ///< how far the picture shows the organ beyond the surface
};

/// What one view says about the deformed surface.
struct CheckedPlaces {
  int width_px = 0, height_px = 0;
  std::vector<TextureShift> texture;
  std::vector<OutlineShift> outline;
};

enum class SurfaceVerdict { holds, moved, cannot_tell };

struct SurfaceFinding {
  SurfaceVerdict verdict = SurfaceVerdict::cannot_tell;
  /// Of what exceeds its bound most or, where nothing does, comes closest to it; empty where nothing can be told.
  std::optional<double> figure_mm, bound_mm;
  std::size_t places = 0;
  std::string words;  ///< where and what, or why it cannot be told
};

/// Whether shifts are more than chance gives in 99 of 100 checks of an organ that has not moved: of the whole picture
/// and of each ninth of it the texture's shift, and the medians of the outline's shifts and of their sizes, each
/// against a bound for as many figures as there are.
SurfaceFinding judge(const CheckedPlaces& places, const CheckErrors& errors);

/// The organ as it was found deformed, and the views it was found by, to be held against later views.
class SurfaceCheck {
 public:
  /// organ: as it is seen. kept: of view_to_check().
  SurfaceCheck(SignedDistance organ, std::vector<PinholeView> kept);

  [[nodiscard]] CheckedPlaces places(const PinholeView& now) const;
  [[nodiscard]] SurfaceFinding check(const PinholeView& now, const CheckErrors& errors) const {
    return judge(places(now), errors);
  }

 private:
  SeenSurface surface_;
  std::vector<EarlierView> kept_;
};

}  // namespace birdseye::host
