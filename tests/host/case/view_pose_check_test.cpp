// Poses of views that follow another convention than they should.
#include "host/case/view_pose_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace birdseye::host {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A ball of 40 mm at that place of a CT.
struct Scene {
  Volume ct;
  std::vector<std::uint8_t> tissue;
  std::vector<VideoView> views;

  explicit Scene(const Eigen::Vector3d& organ_mm = {180, -35, 310}) {
    constexpr int kSize = 50;
    constexpr double kStep_mm = 4;
    ct.size = {kSize, kSize, kSize};
    ct.spacing_mm.setConstant(kStep_mm);
    ct.patient_from_voxel =
        Eigen::Translation3d(organ_mm - Eigen::Vector3d::Constant(kStep_mm * kSize / 2)) * Eigen::Scaling(kStep_mm);
    for (int k = 0; k < kSize; ++k) {
      for (int j = 0; j < kSize; ++j) {
        for (int i = 0; i < kSize; ++i) {
          const bool in = (ct.patient_from_voxel * Eigen::Vector3d(i, j, k) - organ_mm).norm() < 40;
          tissue.push_back(in ? 1 : 0);
        }
      }
    }
    const std::vector<Eigen::Vector3d> ports{{0, -1, 0.2}, {0.4, -0.9, 0}, {-0.5, -0.8, -0.1}, {0, -0.8, 0.6}};
    views.reserve(ports.size());
    for (const Eigen::Vector3d& from : ports) views.push_back(look(organ_mm, organ_mm + 110 * from.normalized()));
  }

  /// A camera of this place that looks at the organ.
  static VideoView look(const Eigen::Vector3d& organ_mm, const Eigen::Vector3d& eye_mm) {
    VideoView view;
    view.name = "view";
    view.camera = {640, 480, 550, 550, 320, 240};
    const Eigen::Vector3d forward = (organ_mm - eye_mm).normalized();
    const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
    Eigen::Matrix3d axes;
    axes << right.transpose(), forward.cross(right).transpose(), forward.transpose();
    view.camera_from_patient = {axes, Eigen::Vector3d(-axes * eye_mm)};
    return view;
  }

  /// What is said of poses that were changed so.
  [[nodiscard]] std::string said(const std::function<Eigen::Matrix4d(const Eigen::Matrix4d&)>& change) const {
    std::vector<VideoView> changed = views;
    for (VideoView& view : changed) {
      const Eigen::Matrix4d wrong = change(view.camera_from_patient.matrix());
      view.camera_from_patient = Transform<Camera, Patient>::from_matrix(wrong);
    }
    return fault_of_poses(changed, ct, tissue);
  }
};

Eigen::Matrix4d in_metres(Eigen::Matrix4d pose) {
  pose.topRightCorner<3, 1>() /= 1000;
  return pose;
}

Eigen::Matrix4d opengl(const Eigen::Matrix4d& pose) {
  return Eigen::Vector4d(1, -1, -1, 1).asDiagonal() * pose;
}

TEST(ViewPoses, AnotherConventionIsNamedWithTheRemedy) {
  const Scene scene;
  EXPECT_THAT(scene.said([](const auto& pose) { return pose; }), IsEmpty());
  EXPECT_THAT(scene.said([](const auto& pose) -> Eigen::Matrix4d { return pose.inverse(); }),
              HasSubstr("seem to be inverted (patient_from_camera): invert them"));
  EXPECT_THAT(scene.said(opengl), HasSubstr("seem to have OpenGL's camera axes (y up, z back)"));
  EXPECT_THAT(scene.said(in_metres), HasSubstr("all views look from the origin of the patient's frame by the poses as "
                                               "they are given; they seem to be in metres"));
  EXPECT_THAT(scene.said([](const auto& pose) { return in_metres(pose.inverse()); }),
              HasSubstr("to be inverted (patient_from_camera): invert them, and to be in metres"));
  EXPECT_THAT(
      scene.said([](const auto& pose) -> Eigen::Matrix4d { return pose * Eigen::Vector4d(-1, -1, 1, 1).asDiagonal(); }),
      HasSubstr("to be of a patient frame in RAS"));
}

TEST(ViewPoses, InvertedOnesAreNamedWhereAllSeeTheOrganByChance) {
  const Scene scene({60, -35, 310});
  EXPECT_THAT(
      scene.said([](const auto& pose) -> Eigen::Matrix4d { return pose.inverse(); }),
      HasSubstr("no view has the organ in its middle by the poses as they are given; they seem to be inverted"));
}

TEST(ViewPoses, OneViewThatLooksAwayIsNoConvention) {
  Scene scene;
  scene.views[1].camera_from_patient =
      Transform<Camera, Patient>::from_matrix(opengl(scene.views[1].camera_from_patient.matrix()));
  EXPECT_THAT(fault_of_poses(scene.views, scene.ct, scene.tissue), IsEmpty());
}

TEST(ViewPoses, WhatNoConventionExplainsIsNotGuessedAt) {
  const Scene scene;
  EXPECT_THAT(scene.said([](Eigen::Matrix4d pose) {
    pose.topRightCorner<3, 1>() += Eigen::Vector3d(4000, 0, -4000);
    return pose;
  }),
              IsEmpty());
}

}  // namespace
}  // namespace birdseye::host
