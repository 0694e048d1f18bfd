#pragma once

#include <vector>

#include "host/registration/similarity/parzen_mutual_information.hpp"
#include "host/registration/views/control_grid.hpp"
#include "host/registration/views/synthetic_view.hpp"

namespace birdseye::host {

/// What keeps a deformation plausible where the pictures say nothing.
struct Prior {
  double strain = 1;      ///< weight of ControlGrid::strain
  double stray = 1.2e-7;  ///< of the sum of the control points' squared displacements, mm: 81 of 30 mm cost 0.009 nats
  double pose = 0.01;     ///< nats that a shift or a turn of the usual size costs; the cost grows with the square
  double usual_shift_mm = 5, usual_turn_rad = 0.09;  ///< by how much given poses are usually off: 5 mm and 5 degrees
};

/// How well a deformation explains all views (the paper's Equation 6, as a mean), and its analytic gradient with
/// respect to every control point: through the mutual information, compositing, light, sampling and the Bezier map.
class MultiView {
 public:
  /// Keeps references to tissue and control. Refuses, naming it, a view in which no pixel counts, or whose pixels that
  /// count have a single grey.
  static Result<MultiView> make(const std::vector<VideoView>& views, const Tissue& tissue, const ControlGrid& control,
                                int reduction, const Prior& prior);

  /// Mean mutual information of the views, in nats, without the prior.
  double similarity(const std::vector<double>& parameters, const Headlight& light);
  /// The value to maximise: the similarity less the prior's penalties.
  double value(const std::vector<double>& parameters, const Headlight& light);
  /// The same with its gradient.
  double value_and_gradient(const std::vector<double>& parameters, const Headlight& light,
                            std::vector<double>& gradient, PoseUnknowns* pose_gradient = nullptr);
  /// Moves all cameras together; identity until then.
  void set_pose(const PoseUnknowns& pose);
  [[nodiscard]] const RigidMotion& motion() const { return motion_; }
  /// The similarity of each view, after any of these three.
  [[nodiscard]] const std::vector<double>& per_view() const { return per_view_; }
  /// How many pixels of view n show tissue, after any of the same three.
  [[nodiscard]] std::size_t tissue_pixels(std::size_t n) const { return views_[n].tissue_pixels(); }

 private:
  MultiView(const Tissue& tissue, const ControlGrid& control, const Prior& prior)
      : tissue_(tissue), control_(control), controlled_(control, tissue.points), motion_(tissue), prior_(prior) {}
  void deform(const std::vector<double>& parameters);
  /// The prior's penalty for the pose, and its gradient.
  [[nodiscard]] double penalty_of_pose(PoseUnknowns* gradient = nullptr) const;
  /// The prior's penalty for the deformation; adds weight times its gradient to gradient.
  double penalty(const std::vector<double>& parameters, double weight, std::vector<double>& gradient) const;

  const Tissue& tissue_;
  const ControlGrid& control_;
  ControlledGrid controlled_;
  RigidMotion motion_;
  PoseUnknowns pose_{};
  Prior prior_;
  std::vector<SyntheticView> views_;
  std::vector<ParzenMutualInformation> measures_;
  std::vector<double> per_view_;
  std::vector<float> moves_, warped_;
  std::vector<double> deformed_by_;  ///< the parameters that warped_ is by; none before the first
};

}  // namespace birdseye::host
