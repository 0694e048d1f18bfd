#include "host/registration/views/multi_view.hpp"

#include <tbb/parallel_for.h>

#include <numeric>
#include <tuple>

namespace birdseye::host {

Result<MultiView> MultiView::make(const std::vector<VideoView>& views, const Tissue& tissue, const ControlGrid& control,
                                  int reduction, const Prior& prior) {
  MultiView made(tissue, control, prior);
  made.views_.reserve(views.size());
  for (const VideoView& view : views) {
    const SyntheticView& synthetic = made.views_.emplace_back(view, tissue, reduction);
    const std::vector<std::uint8_t> all(synthetic.video().size(), 1);
    auto measure =
        ParzenMutualInformation::make({static_cast<int>(all.size()), all.empty() ? 0 : 1, synthetic.video(), all});
    if (!measure) return measure.error().with_context(view.name);
    made.measures_.push_back(*std::move(measure));
  }
  made.per_view_.resize(views.size());
  return made;
}

void MultiView::set_pose(const PoseUnknowns& pose) {
  if (pose == pose_) return;
  pose_ = pose;
  for (SyntheticView& view : views_) view.look_from(motion_.patient_from_model(pose));
}

double MultiView::penalty_of_pose(PoseUnknowns* gradient) const {
  const double turn_mm = prior_.usual_turn_rad * motion_.gyration_mm();
  double penalty = 0;
  for (std::size_t i = 0; i < pose_.size(); ++i) {
    const double usual_mm = i < 3 ? prior_.usual_shift_mm : turn_mm;
    const double by = prior_.pose * pose_[i] / (usual_mm * usual_mm);
    penalty += by * pose_[i];
    if (gradient != nullptr) (*gradient)[i] = 2 * by;
  }
  return penalty;
}

double MultiView::penalty(const std::vector<double>& parameters, double weight, std::vector<double>& gradient) const {
  const double strain = control_.strain(parameters, tissue_.box_mm(), weight * prior_.strain, gradient);
  double squares = 0;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    squares += parameters[i] * parameters[i];
    gradient[i] += weight * 2 * prior_.stray * parameters[i];
  }
  return prior_.strain * strain + prior_.stray * squares;
}

void MultiView::deform(const std::vector<double>& parameters) {
  if (parameters == deformed_by_) return;  // another lamp alone is tried
  controlled_.displacements(parameters, moves_);
  warp(tissue_, moves_, warped_);
  deformed_by_ = parameters;
}

double MultiView::similarity(const std::vector<double>& parameters, const Headlight& light) {
  deform(parameters);
  tbb::parallel_for(std::size_t{0}, views_.size(),
                    [&](std::size_t n) { per_view_[n] = measures_[n].value(views_[n].render(warped_, light)); });
  return std::accumulate(per_view_.begin(), per_view_.end(), 0.0) / static_cast<double>(views_.size());
}

double MultiView::value(const std::vector<double>& parameters, const Headlight& light) {
  std::vector<double> unused(parameters.size(), 0.0);
  return similarity(parameters, light) - penalty(parameters, 0, unused) - penalty_of_pose();
}

double MultiView::value_and_gradient(const std::vector<double>& parameters, const Headlight& light,
                                     std::vector<double>& gradient, PoseUnknowns* pose_gradient) {
  deform(parameters);
  std::vector<std::vector<float>> by_warped(views_.size());
  std::vector<Wrench> on_cameras(views_.size());
  tbb::parallel_for(std::size_t{0}, views_.size(), [&](std::size_t n) {
    const std::vector<double>& grey = views_[n].render(warped_, light);
    std::vector<double> by_grey(grey.size());
    per_view_[n] = measures_[n].value_and_gradient(grey, by_grey);
    for (double& by : by_grey) by /= static_cast<double>(views_.size());
    by_warped[n].assign(warped_.size(), 0.0F);
    views_[n].pull_back(warped_, by_grey, by_warped[n], pose_gradient != nullptr ? &on_cameras[n] : nullptr);
  });
  for (std::size_t n = 1; n < views_.size(); ++n) {
    for (std::size_t v = 0; v < warped_.size(); ++v) by_warped[0][v] += by_warped[n][v];
  }
  std::vector<float> by_move;
  pull_back_warp(tissue_, moves_, by_warped[0], by_move);
  gradient.assign(parameters.size(), 0.0);
  controlled_.pull_back(by_move, gradient);
  if (pose_gradient != nullptr) {
    for (std::size_t n = 1; n < views_.size(); ++n) on_cameras[0] += on_cameras[n];
    *pose_gradient = motion_.gradient(pose_, on_cameras[0]);
    PoseUnknowns by_penalty{};
    std::ignore = penalty_of_pose(&by_penalty);
    for (std::size_t i = 0; i < pose_.size(); ++i) (*pose_gradient)[i] -= by_penalty[i];
  }
  const double similarity =
      std::accumulate(per_view_.begin(), per_view_.end(), 0.0) / static_cast<double>(views_.size());
  return similarity - penalty(parameters, -1, gradient) - penalty_of_pose();
}

}  // namespace birdseye::host
