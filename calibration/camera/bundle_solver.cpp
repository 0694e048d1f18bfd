#include "calibration/camera/bundle_solver.hpp"

#include <ceres/manifold.h>

#include <utility>
#include <vector>

namespace birdseye::calibration {

void hold_unsolved(ceres::Problem& problem, double* lens, const std::array<bool, CameraModel::kParameters>& solved) {
  std::vector<int> fixed;
  for (int i = 0; i < CameraModel::kParameters; ++i) {
    if (!solved[static_cast<std::size_t>(i)]) fixed.push_back(i);
  }
  if (!fixed.empty()) problem.SetManifold(lens, new ceres::SubsetManifold(CameraModel::kParameters, fixed));
}

ceres::Solver::Summary solve_bundle(ceres::Problem& problem, std::shared_ptr<ceres::ParameterBlockOrdering> ordering,
                                    const BundleSettings& settings) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering = std::move(ordering);
  options.max_num_iterations = settings.most_steps;
  options.function_tolerance = settings.tolerance;
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = 1e-14;
  // Damping of a billionth keeps Cholesky's factors of what views leave open, and costs no digit of what they do not.
  options.max_trust_region_radius = 1e9;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary;
}

}  // namespace birdseye::calibration
