#include "host/registration/geometry/pose_bundle.hpp"

#include <ceres/autodiff_cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/ordered_groups.h>
#include <ceres/problem.h>
#include <ceres/rotation.h>
#include <ceres/solver.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "calibration/geometry/rotations.hpp"
#include "host/registration/geometry/patch.hpp"

namespace birdseye::host {

namespace {

constexpr double kMatch_px = 0.5;  ///< standard deviation of a match, in pixels of a picture 768 wide

double sigma_px(const PinholeView& view) {
  return kMatch_px * view.width_px / kReferenceWidth_px;
}

/// How far a place of one view is seen in the other from where it was found, in standard deviations.
struct Reprojection {
  const PinholeView& view;
  const PinholeView& other;
  Eigen::Vector3d ray;  ///< of the view's camera as it was given, unit depth
  Eigen::Vector2d found_px;

  template <typename T>
  bool operator()(const T* of_view, const T* of_other, const T* depth_mm, const T* log_focal, T* off) const {
    using std::exp;
    using Vector = Eigen::Matrix<T, 3, 1>;
    const T focal = exp(log_focal[0]);
    const Vector ray_t(ray.x() / focal, ray.y() / focal, T(1));
    Vector turned;
    const std::array<T, 3> back{-of_view[0], -of_view[1], -of_view[2]};
    ceres::AngleAxisRotatePoint(back.data(), ray_t.data(), turned.data());
    const Vector place = view.eye_in_patient_mm.cast<T>() + Vector(of_view[3], of_view[4], of_view[5]) +
                         view.camera_from_patient.rotation().transpose().cast<T>() * (turned * depth_mm[0]);
    const Vector from_eye = other.camera_from_patient.rotation().cast<T>() *
                            (place - other.eye_in_patient_mm.cast<T>() - Vector(of_other[3], of_other[4], of_other[5]));
    Vector seen;
    ceres::AngleAxisRotatePoint(of_other, from_eye.data(), seen.data());
    if (seen.z() < T(1)) return false;
    const double sigma = sigma_px(other);
    off[0] = (seen.x() / seen.z() * other.fx_px * focal + other.cx_px - found_px.x()) / sigma;
    off[1] = (seen.y() / seen.z() * other.fy_px * focal + other.cy_px - found_px.y()) / sigma;
    return true;
  }
};

/// A change in standard deviations of what poses err by.
struct PosePrior {
  PoseNoise noise;

  template <typename T>
  bool operator()(const T* change, T* off) const {
    for (int i = 0; i < 3; ++i) {
      off[i] = change[i] / noise.angle_rad;
      off[i + 3] = change[i + 3] / noise.eye_mm;
    }
    return true;
  }
};

/// What the focal lengths err by, in standard deviations.
struct FocalPrior {
  double sigma;

  template <typename T>
  bool operator()(const T* log_focal, T* off) const {
    off[0] = log_focal[0] / sigma;
    return true;
  }
};

using Cost = ceres::AutoDiffCostFunction<Reprojection, 2, 6, 6, 1, 1>;

Reprojection reprojection(const std::vector<PinholeView>& views, const TextureMatch& match) {
  const PinholeView& view = views[match.view];
  return {view,
          views[match.other_view],
          {(match.at_px.x() - view.cx_px) / view.fx_px, (match.at_px.y() - view.cy_px) / view.fy_px, 1},
          match.other_px};
}

Eigen::Index first_of(std::size_t view) {
  return 6 * static_cast<Eigen::Index>(view);
}

}  // namespace

PoseBundle::PoseBundle(const std::vector<PinholeView>& views, std::span<const TextureMatch> matches)
    : views_(views), matches_(matches), changes_(views.size(), Change{}) {
  for (const TextureMatch& match : matches) depths_mm_.resize(std::max(depths_mm_.size(), match.place + 1), 0);
  for (const TextureMatch& match : matches) depths_mm_[match.place] = match.depth_mm;
}

void PoseBundle::solve(const PoseNoise& noise, double scale) {
  ceres::Problem::Options owned_here;
  owned_here.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(owned_here);
  ceres::CauchyLoss robust(scale);
  const auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (const TextureMatch& match : matches_) {
    problem.AddResidualBlock(new Cost(new Reprojection(reprojection(views_, match))), &robust,
                             changes_[match.view].data(), changes_[match.other_view].data(), &depths_mm_[match.place],
                             &log_focal_);
    ordering->AddElementToGroup(&depths_mm_[match.place], 0);
  }
  for (std::size_t n = 0; n < changes_.size(); ++n) {
    double* const change = changes_[n].data();
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PosePrior, 6, 6>(new PosePrior{known_of(n, noise)}),
                             nullptr, change);
    ordering->AddElementToGroup(change, 1);
  }
  ordering->AddElementToGroup(&log_focal_, 1);
  if (focal_sigma_ > 0) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<FocalPrior, 1, 1>(new FocalPrior{focal_sigma_}), nullptr,
                             &log_focal_);
  } else {
    problem.SetParameterBlockConstant(&log_focal_);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering = ordering;
  options.max_num_iterations = 20;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
}

void PoseBundle::find_focal_error(double sigma) {
  focal_sigma_ = sigma;
}

FocalError PoseBundle::focal_error(const PoseNoise& noise, double scale) const {
  if (!(focal_sigma_ > 0)) return {};
  // Too long by that share, where the true ones are shorter.
  return {std::expm1(-log_focal_), std::sqrt(posterior(noise, scale).covariance(unknowns() - 1, unknowns() - 1))};
}

void PoseBundle::set_free(std::size_t view) {
  free_ = view;
}

PoseNoise PoseBundle::known_of(std::size_t view, const PoseNoise& noise) const {
  constexpr PoseNoise kNothing{100, 0.5};
  return free_ == view ? kNothing : noise;
}

PoseMove PoseBundle::moved_by(std::size_t view) const {
  const Eigen::Map<const Eigen::Matrix<double, 6, 1>> change(changes_[view].data());
  return {change.tail<3>().norm(), change.head<3>().norm()};
}

double PoseBundle::deviations(std::size_t view, const PoseNoise& noise, double scale) const {
  const Eigen::Map<const Eigen::Matrix<double, 6, 1>> change(changes_[view].data());
  Eigen::Matrix<double, 6, 6> covariance =
      posterior(noise, scale).covariance.block<6, 6>(first_of(view), first_of(view));
  covariance.diagonal().head<3>().array() += noise.angle_rad * noise.angle_rad;
  covariance.diagonal().tail<3>().array() += noise.eye_mm * noise.eye_mm;
  return std::sqrt(change.dot(covariance.ldlt().solve(change)));
}

Eigen::Vector3d PoseBundle::ray_of(const TextureMatch& match) const {
  const Eigen::Vector3d ray = reprojection(views_, match).ray;
  return {ray.x() / std::exp(log_focal_), ray.y() / std::exp(log_focal_), 1};
}

Eigen::Index PoseBundle::unknowns() const {
  return first_of(changes_.size()) + (focal_sigma_ > 0 ? 1 : 0);
}

PoseNoise PoseBundle::noise(const PoseNoise& prior, double scale) const {
  constexpr double kFewest = 1;
  const Eigen::VectorXd open = posterior(prior, scale).covariance.diagonal();
  double angles = 0, shifts_mm2 = 0, of_angles = 0, of_shifts = 0;
  for (std::size_t n = 0; n < changes_.size(); ++n) {
    if (free_ == n) continue;
    const Eigen::Map<const Eigen::Matrix<double, 6, 1>> change(changes_[n].data());
    angles += change.head<3>().squaredNorm();
    shifts_mm2 += change.tail<3>().squaredNorm();
    of_angles += 3 - open.segment<3>(first_of(n)).sum() / (prior.angle_rad * prior.angle_rad);
    of_shifts += 3 - open.segment<3>(first_of(n) + 3).sum() / (prior.eye_mm * prior.eye_mm);
  }
  return {std::sqrt(shifts_mm2 / std::max(kFewest, of_shifts)), std::sqrt(angles / std::max(kFewest, of_angles))};
}

PoseBundle::Posterior PoseBundle::posterior(const PoseNoise& noise, double scale) const {
  const Eigen::Index unknowns = this->unknowns();
  Eigen::MatrixXd precision = Eigen::MatrixXd::Zero(unknowns, unknowns);
  for (std::size_t n = 0; n < changes_.size(); ++n) {
    const PoseNoise known = known_of(n, noise);
    precision.diagonal().segment<3>(first_of(n)).setConstant(1 / (known.angle_rad * known.angle_rad));
    precision.diagonal().segment<3>(first_of(n) + 3).setConstant(1 / (known.eye_mm * known.eye_mm));
  }
  if (focal_sigma_ > 0) precision(unknowns - 1, unknowns - 1) = 1 / (focal_sigma_ * focal_sigma_);
  Posterior out;
  out.places.resize(depths_mm_.size(), {Eigen::RowVectorXd::Zero(unknowns), 0});
  for (const TextureMatch& match : matches_) {
    const Cost cost(new Reprojection(reprojection(views_, match)));
    Eigen::Matrix<double, 2, 6, Eigen::RowMajor> by_view, by_other;
    Eigen::Vector2d by_depth, by_focal, off;
    const std::array<const double*, 4> at{changes_[match.view].data(), changes_[match.other_view].data(),
                                          &depths_mm_[match.place], &log_focal_};
    std::array<double*, 4> jacobians{by_view.data(), by_other.data(), by_depth.data(), by_focal.data()};
    if (!cost.Evaluate(at.data(), off.data(), jacobians.data())) continue;
    Eigen::Matrix2Xd by_changes = Eigen::Matrix2Xd::Zero(2, unknowns);
    by_changes.middleCols<6>(first_of(match.view)) = by_view;
    by_changes.middleCols<6>(first_of(match.other_view)) = by_other;
    if (focal_sigma_ > 0) by_changes.col(unknowns - 1) = by_focal;
    const double weight = 1 / (1 + off.squaredNorm() / (scale * scale));  // Cauchy's
    precision += weight * by_changes.transpose() * by_changes;
    Place& place = out.places[match.place];
    place.by_changes += weight * by_depth.transpose() * by_changes;
    place.by_depth += weight * by_depth.squaredNorm();
  }
  for (const Place& place : out.places) {
    if (place.by_depth > 0) precision -= place.by_changes.transpose() * place.by_changes / place.by_depth;
  }
  out.covariance = precision.ldlt().solve(Eigen::MatrixXd::Identity(unknowns, unknowns));
  return out;
}

CommonPoseError PoseBundle::common_error(const PoseNoise& noise, double scale) const {
  const Posterior found = posterior(noise, scale);
  const std::vector<Transform<Camera, Patient>> poses = this->poses();
  const std::vector<Eigen::Vector3d> places_mm = this->places_mm();
  // Each place once, however many views it was matched with.
  std::vector<const TextureMatch*> one_of(found.places.size(), nullptr);
  for (const TextureMatch& match : matches_) {
    if (found.places[match.place].by_depth > 0) one_of[match.place] = &match;
  }
  std::erase(one_of, nullptr);
  Eigen::Vector3d about_mm = Eigen::Vector3d::Zero();
  for (const TextureMatch* match : one_of) about_mm += places_mm[match->place] / static_cast<double>(one_of.size());
  // The motion by least squares of how far all places move.
  CommonPoseError::Covariance normal = CommonPoseError::Covariance::Zero();
  Eigen::MatrixXd motion_by_changes = Eigen::MatrixXd::Zero(kCommonErrors, found.covariance.cols());
  for (const TextureMatch* match : one_of) {
    const Place& place = found.places[match->place];
    const Eigen::Matrix3d patient_from_camera = poses[match->view].rotation().transpose();
    const Eigen::Vector3d ray = ray_of(*match);
    Eigen::Matrix3Xd place_by_changes = patient_from_camera * ray * (-place.by_changes / place.by_depth);
    const Eigen::Index at = first_of(match->view);
    place_by_changes.middleCols<3>(at) += patient_from_camera * cross_matrix(depths_mm_[match->place] * ray);
    place_by_changes.middleCols<3>(at + 3) += Eigen::Matrix3d::Identity();
    const Eigen::Matrix<double, 3, kCommonErrors> by_motion = moves_by(places_mm[match->place] - about_mm);
    normal += by_motion.transpose() * by_motion;
    motion_by_changes += by_motion.transpose() * place_by_changes;
  }
  motion_by_changes = normal.ldlt().solve(motion_by_changes).eval();
  return {about_mm, motion_by_changes * found.covariance * motion_by_changes.transpose()};
}

bool PoseBundle::agrees(const TextureMatch& match) const {
  constexpr double kMost = kAgrees_px / kMatch_px;
  Eigen::Vector2d off;
  return reprojection(views_, match)(changes_[match.view].data(), changes_[match.other_view].data(),
                                     &depths_mm_[match.place], &log_focal_, off.data()) &&
         off.norm() < kMost;
}

std::size_t PoseBundle::agreeing() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(matches_, [&](const TextureMatch& match) { return agrees(match); }));
}

std::size_t PoseBundle::agreeing(std::size_t view) const {
  return static_cast<std::size_t>(std::ranges::count_if(matches_, [&](const TextureMatch& match) {
    return (match.view == view || match.other_view == view) && agrees(match);
  }));
}

std::vector<Transform<Camera, Patient>> PoseBundle::poses() const {
  std::vector<Transform<Camera, Patient>> out;
  for (std::size_t n = 0; n < views_.size(); ++n) {
    const Change& c = changes_[n];
    const Eigen::Matrix3d rotation =
        rotation_exp(Eigen::Vector3d(c[0], c[1], c[2])) * views_[n].camera_from_patient.rotation();
    const Eigen::Vector3d eye_mm = views_[n].eye_in_patient_mm + Eigen::Vector3d(c[3], c[4], c[5]);
    out.emplace_back(rotation, Eigen::Vector3d(-rotation * eye_mm));
  }
  return out;
}

std::vector<Eigen::Vector3d> PoseBundle::places_mm() const {
  std::vector<Eigen::Vector3d> out(depths_mm_.size(), Eigen::Vector3d::Zero());
  const std::vector<Transform<Camera, Patient>> poses = this->poses();
  for (const TextureMatch& match : matches_) {
    const Eigen::Vector3d ray = ray_of(match);
    out[match.place] = poses[match.view].inverse() * Eigen::Vector3d(depths_mm_[match.place] * ray);
  }
  return out;
}

}  // namespace birdseye::host
