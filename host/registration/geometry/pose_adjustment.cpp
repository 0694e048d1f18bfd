#include "host/registration/geometry/pose_adjustment.hpp"

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
#include <numbers>

#include "calibration/geometry/rotations.hpp"
#include "host/registration/geometry/patch.hpp"

namespace birdseye::host {

namespace {

/// What a pose is changed by: a turn of the camera about its eye, camera frame, and the eye's shift, patient mm.
using Change = std::array<double, 6>;

constexpr double kMatch_px = 0.5;  ///< standard deviation of a match, in pixels of a picture 768 wide

double sigma_px(const PinholeView& view) {
  return kMatch_px * view.width_px / kReferenceWidth_px;
}

/// How far a place of one view is seen in the other from where it was found, in standard deviations.
struct Reprojection {
  const PinholeView& view;
  const PinholeView& other;
  Eigen::Vector3d ray;  ///< of the view's camera, unit depth
  Eigen::Vector2d found_px;

  template <typename T>
  bool operator()(const T* of_view, const T* of_other, const T* depth_mm, T* off) const {
    using Vector = Eigen::Matrix<T, 3, 1>;
    const Vector ray_t = ray.cast<T>();
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
    off[0] = (seen.x() / seen.z() * other.fx_px + other.cx_px - found_px.x()) / sigma;
    off[1] = (seen.y() / seen.z() * other.fy_px + other.cy_px - found_px.y()) / sigma;
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

class Bundle {
 public:
  Bundle(const std::vector<PinholeView>& views, std::span<const TextureMatch> matches)
      : views_(views), matches_(matches), changes_(views.size(), Change{}) {
    for (const TextureMatch& match : matches) depths_mm_.resize(std::max(depths_mm_.size(), match.place + 1), 0);
    for (const TextureMatch& match : matches) depths_mm_[match.place] = match.depth_mm;
  }

  void solve(const PoseNoise& noise, double scale) {
    ceres::Problem::Options owned_here;
    owned_here.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::Problem problem(owned_here);
    ceres::CauchyLoss robust(scale);
    const auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    for (const TextureMatch& match : matches_) {
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Reprojection, 2, 6, 6, 1>(new Reprojection(of(match))),
                               &robust, changes_[match.view].data(), changes_[match.other_view].data(),
                               &depths_mm_[match.place]);
      ordering->AddElementToGroup(&depths_mm_[match.place], 0);
    }
    for (Change& change : changes_) {
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PosePrior, 6, 6>(new PosePrior{noise}), nullptr,
                               change.data());
      ordering->AddElementToGroup(change.data(), 1);
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering = ordering;
    options.max_num_iterations = 20;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
  }

  /// Of the changes. A shift, a turn and a scale that all views share show in no picture, and take away freedoms.
  [[nodiscard]] PoseNoise noise() const {
    double angles = 0, shifts_mm2 = 0;
    for (const Change& change : changes_) {
      for (std::size_t i = 0; i < 3; ++i) {
        angles += change[i] * change[i];
        shifts_mm2 += change[i + 3] * change[i + 3];
      }
    }
    const double axes = 3 * static_cast<double>(changes_.size());
    return {std::sqrt(shifts_mm2 / (axes - 4)), std::sqrt(angles / (axes - 3))};
  }

  [[nodiscard]] std::size_t agreeing() const {
    constexpr double kMost = 3;
    return static_cast<std::size_t>(std::count_if(matches_.begin(), matches_.end(), [&](const TextureMatch& match) {
      Eigen::Vector2d off;
      return of(match)(changes_[match.view].data(), changes_[match.other_view].data(), &depths_mm_[match.place],
                       off.data()) &&
             off.norm() < kMost;
    }));
  }

  [[nodiscard]] std::vector<Transform<Camera, Patient>> poses() const {
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

 private:
  [[nodiscard]] Reprojection of(const TextureMatch& match) const {
    const PinholeView& view = views_[match.view];
    return {view,
            views_[match.other_view],
            {(match.at_px.x() - view.cx_px) / view.fx_px, (match.at_px.y() - view.cy_px) / view.fy_px, 1},
            match.other_px};
  }

  const std::vector<PinholeView>& views_;
  std::span<const TextureMatch> matches_;
  std::vector<Change> changes_;
  std::vector<double> depths_mm_;
};

/// How a place moves with a shift, a turn and a scale of everything about another.
Eigen::Matrix<double, 3, 7> moves_by(const Eigen::Vector3d& from_middle_mm) {
  Eigen::Matrix<double, 3, 7> out;
  out << Eigen::Matrix3d::Identity(), -cross_matrix(from_middle_mm), from_middle_mm;
  return out;
}

}  // namespace

std::optional<AdjustedPoses> adjusted_poses(const std::vector<PinholeView>& views,
                                            std::span<const TextureMatch> matches) {
  constexpr std::size_t kFewest = 40;
  constexpr double kLeastShare = 0.4;
  constexpr double kDegree = std::numbers::pi / 180;
  constexpr PoseNoise kWidest{2, 0.5 * kDegree}, kNarrowest{0.02, 0.005 * kDegree};
  constexpr std::array kScales{8.0, 4.0, 2.0};
  if (views.size() < 2 || matches.size() < kFewest) return std::nullopt;
  Bundle bundle(views, matches);
  PoseNoise noise = kWidest;
  for (const double scale : kScales) bundle.solve(noise, scale);
  for (int i = 0; i < 3; ++i) {
    const PoseNoise found = bundle.noise();
    noise = {std::clamp(found.eye_mm, kNarrowest.eye_mm, kWidest.eye_mm),
             std::clamp(found.angle_rad, kNarrowest.angle_rad, kWidest.angle_rad)};
    bundle.solve(noise, kScales.back());
  }
  const std::size_t agreeing = bundle.agreeing();
  if (agreeing < kFewest || static_cast<double>(agreeing) < kLeastShare * static_cast<double>(matches.size()))
    return std::nullopt;
  return AdjustedPoses{bundle.poses(), noise, agreeing};
}

std::optional<AdjustedPoses> adjusted_poses(const std::vector<PinholeView>& views, const SeenSurface& surface) {
  constexpr double kNear_px = 3, kFar_px = 12, kMany = 0.2;
  MatchSettings settings;
  settings.beside_px = kNear_px;
  const TextureMatches near = texture_matches(views, surface, settings);
  const auto few = [&](const std::optional<AdjustedPoses>& found) {
    return !found || static_cast<double>(found->matches) < kMany * static_cast<double>(near.looked_for);
  };
  auto found = adjusted_poses(views, near.found);
  if (!few(found)) return found;
  settings.beside_px = kFar_px;
  auto further = adjusted_poses(views, texture_matches(views, surface, settings).found);
  if (!further || (found && further->matches <= found->matches)) return found;
  // Patches overlap better once their views have moved.
  settings.beside_px = kNear_px;
  std::vector<PinholeView> there;
  for (std::size_t n = 0; n < views.size(); ++n) there.push_back(moved(views[n], further->camera_from_patient[n]));
  auto again = adjusted_poses(views, texture_matches(there, surface, settings).found);
  return again && again->matches > further->matches ? again : further;
}

CommonPoseError::CommonPoseError(const std::vector<PinholeView>& views, const PoseNoise& noise) {
  for (const PinholeView& view : views) about_mm_ += view.eye_in_patient_mm / static_cast<double>(views.size());
  Motion precision = Motion::Zero();
  for (const PinholeView& view : views) {
    const Eigen::Matrix<double, 3, 7> eye = moves_by(view.eye_in_patient_mm - about_mm_);
    precision += eye.transpose() * eye / (noise.eye_mm * noise.eye_mm);
    precision.block<3, 3>(3, 3).diagonal().array() += 1 / (noise.angle_rad * noise.angle_rad);
  }
  covariance_ = precision.ldlt().solve(Motion::Identity());
}

Eigen::Matrix3d CommonPoseError::covariance(const Eigen::Vector3d& place_mm) const {
  const Eigen::Matrix<double, 3, 7> by = moves_by(place_mm - about_mm_);
  return by * covariance_ * by.transpose();
}

}  // namespace birdseye::host
