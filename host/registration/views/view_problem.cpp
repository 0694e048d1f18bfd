#include "host/registration/views/view_problem.hpp"

#include <algorithm>
#include <cmath>
#include <nlopt.hpp>

namespace birdseye::host {

namespace {

using Parameters = std::vector<double>;

/// Every so many pixels along each axis.
int reduction_of(const Resolution& resolution, const VideoView& view) {
  const auto counts = view.mask.size() - static_cast<std::size_t>(std::count(view.mask.begin(), view.mask.end(), 0));
  const double most = std::sqrt(static_cast<double>(counts) / resolution.least_pixels);
  return std::max(1, std::min(view.camera.width_px / resolution.width_px, static_cast<int>(most)));
}

}  // namespace

double spacing_mm(const Resolution& resolution, const Volume& ct) {
  const Eigen::Vector3d extent_mm = ct.spacing_mm.cwiseProduct(Eigen::Vector3d(ct.size[0], ct.size[1], ct.size[2]));
  return std::min(resolution.spacing_mm, extent_mm.maxCoeff() / resolution.least_points);
}

Result<ViewProblem> ViewProblem::make(const std::vector<VideoView>& views, const Tissue& tissue,
                                      const ControlGrid& control, const Resolution& resolution, const Prior& prior,
                                      ViewRegistration& record, const RegistrationWatch& watch) {
  const int reduction = reduction_of(resolution, views.front());
  auto made = MultiView::make(views, tissue, control, reduction, prior);
  if (!made) return made.error();
  return ViewProblem(control, reduction, *std::move(made), record, watch);
}

double ViewProblem::similarity(const std::vector<double>& parameters, const Headlight& light) {
  ++record_.evaluations;
  if (record_.pose) views_.set_pose(*record_.pose);
  return views_.similarity(parameters, light);
}

std::vector<double> ViewProblem::climb(const std::vector<double>& start, const Headlight& light, int most_steps,
                                       Free free) {
  std::vector<double> even = control_.to_even(start);
  const auto inner = static_cast<std::ptrdiff_t>(even.size());
  if (record_.pose) even.insert(even.end(), record_.pose->begin(), record_.pose->end());
  nlopt::opt optimiser(nlopt::LD_LBFGS, static_cast<unsigned>(even.size()));
  const auto objective = [&](const std::vector<double>& x, std::vector<double>& gradient) {
    if (watch_.cancelled()) throw nlopt::forced_stop();
    ++record_.gradient_evaluations;
    PoseUnknowns pose{};
    std::copy(x.begin() + inner, x.end(), pose.begin());
    auto [value, by] = value_and_gradient(control_.from_even({x.begin(), x.begin() + inner}), pose, light);
    if (!gradient.empty()) {
      gradient = control_.gradient_to_even({by.begin(), by.begin() + inner});
      if (free == Free::pose) std::fill(gradient.begin(), gradient.end(), 0.0);
      gradient.insert(gradient.end(), by.begin() + inner, by.end());
    }
    record_.trace.push_back({reduction_, static_cast<std::size_t>(inner), value});
    return value;
  };
  using Objective = decltype(objective);
  optimiser.set_max_objective([](const std::vector<double>& x, std::vector<double>& gradient,
                                 void* data) { return (*static_cast<Objective*>(data))(x, gradient); },
                              const_cast<void*>(static_cast<const void*>(&objective)));
  optimiser.set_maxeval(most_steps);
  optimiser.set_ftol_rel(1e-5);
  double value = 0;
  try {
    optimiser.optimize(even, value);
  } catch (const std::exception&) {
    // It stops so where rounding keeps it from climbing further; what it reached stands.
  }
  if (record_.pose) std::copy(even.begin() + inner, even.end(), record_.pose->begin());
  return control_.from_even({even.begin(), even.begin() + inner});
}

std::pair<double, std::vector<double>> ViewProblem::value_and_gradient(const std::vector<double>& parameters,
                                                                       const PoseUnknowns& pose,
                                                                       const Headlight& light) {
  views_.set_pose(pose);
  std::vector<double> gradient;
  PoseUnknowns by_pose{};
  const double value = views_.value_and_gradient(parameters, light, gradient, record_.pose ? &by_pose : nullptr);
  if (record_.pose) gradient.insert(gradient.end(), by_pose.begin(), by_pose.end());
  return {value, gradient};
}

Headlight find_light(ViewProblem& problem, const Parameters& parameters, const Headlight& start, bool& at_limit) {
  const auto light_of = [](const Parameters& x) {
    Headlight light;
    light.offset_in_camera_mm = {10 * x[0], 10 * x[1], 0};
    light.falloff = 2 * x[2];
    light.ambient = 0.1 * x[3];
    light.vignette = x[4];
    return light;
  };
  Parameters x{start.offset_in_camera_mm.x() / 10, start.offset_in_camera_mm.y() / 10, start.falloff / 2,
               std::clamp(start.ambient / 0.1, 0.1, 5.0), start.vignette};
  const auto objective = [&](const Parameters& at, Parameters&) {
    return problem.similarity(parameters, light_of(at));
  };
  using Objective = decltype(objective);
  nlopt::opt optimiser(nlopt::LN_SBPLX, 5);
  optimiser.set_max_objective([](const Parameters& at, Parameters& gradient,
                                 void* data) { return (*static_cast<Objective*>(data))(at, gradient); },
                              const_cast<void*>(static_cast<const void*>(&objective)));
  const Parameters low{-6, -6, 0.5, 0.1, 0}, high{6, 6, 1.5, 5, 0.8};
  optimiser.set_lower_bounds(low);
  optimiser.set_upper_bounds(high);
  optimiser.set_initial_step({0.5, 0.5, 0.2, 0.5, 0.15});
  optimiser.set_maxeval(60);
  double value = 0;
  try {
    optimiser.optimize(x, value);
  } catch (const std::exception&) {
    // As above.
  }
  // Little ambient light and a lens without vignette are no limits but ends of what there is.
  at_limit = false;
  for (const std::size_t i : std::initializer_list<std::size_t>{0, 1, 2, 4}) {
    const double near = 1e-3 * (high[i] - low[i]);
    at_limit = at_limit || x[i] > high[i] - near || (i != 4 && x[i] < low[i] + near);
  }
  return light_of(x);
}

}  // namespace birdseye::host
