#pragma once

#include <ceres/ordered_groups.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <array>
#include <memory>

#include "calibration/camera/camera_bundle.hpp"

/// What the bundles of one camera and of two share. Apart, so that no header of them brings Ceres.
namespace birdseye::calibration {

/// Keeps the parameters of a lens that are not solved for where they are.
void hold_unsolved(ceres::Problem& problem, double* lens, const std::array<bool, CameraModel::kParameters>& solved);

/// ordering: the boards' poses in group 0, all else in group 1.
ceres::Solver::Summary solve_bundle(ceres::Problem& problem, std::shared_ptr<ceres::ParameterBlockOrdering> ordering,
                                    const BundleSettings& settings);

}  // namespace birdseye::calibration
