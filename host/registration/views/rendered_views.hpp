#pragma once

#include <memory>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/deform/displacement_field.hpp"
#include "host/registration/similarity/similarity.hpp"
#include "host/registration/views/synthetic_view.hpp"
#include "host/registration/views/tissue.hpp"
#include "host/render/cpu/ray_caster.hpp"

namespace birdseye::host {

/// The paper's way to judge a deformation: every view is drawn at its full size by the cpu engine, lit from the lens,
/// and compared with its video over the pixels that count. One deformation is resampled once for all views.
class RenderedViews {
 public:
  /// Copies the tissue as a shell: what lies deeper than light reaches in an opaque organ is left out, for it would be
  /// resampled and lit and never be seen. similarity: one of similarity_names(). Refuses, naming the view, what
  /// make_similarity() refuses.
  static Result<RenderedViews> make(const std::vector<VideoView>& views, const Tissue& tissue,
                                    const std::string& similarity);

  /// Mean similarity over the views (equation 6, over their number).
  double similarity(const DisplacementField& field);
  /// The similarity of each view, after similarity().
  [[nodiscard]] const std::vector<double>& per_view() const { return per_view_; }
  /// Of view n, after similarity(): how many pixels that count show tissue.
  [[nodiscard]] std::size_t tissue_pixels(std::size_t n) const { return tissue_pixels_[n]; }

 private:
  struct View {
    std::shared_ptr<const LensRays> rays;  ///< views through one lens share them
    Transform<Camera, Patient> camera_from_patient;
    std::vector<std::uint8_t> mask;
    std::unique_ptr<Similarity> measure;
  };
  RenderedViews() = default;

  std::unique_ptr<Volume> shell_;
  std::unique_ptr<RayCaster> caster_;
  std::vector<View> views_;
  std::vector<double> per_view_;
  std::vector<std::size_t> tissue_pixels_;
  std::vector<std::uint8_t> grey_;
};

}  // namespace birdseye::host
