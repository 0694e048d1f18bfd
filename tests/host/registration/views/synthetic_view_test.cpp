#include "host/registration/views/synthetic_view.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "tests/support/lens.hpp"

namespace birdseye::host {
namespace {

/// A ball about the patient's origin, in a box of 200 mm; exact.
struct Ball {
  double radius_mm;

  [[nodiscard]] Tissue tissue(double spacing_mm) const {
    Volume box;
    box.size = {101, 101, 101};
    box.spacing_mm = {2, 2, 2};
    box.patient_from_voxel.linear() = 2 * Eigen::Matrix3d::Identity();
    box.patient_from_voxel.translation() = Eigen::Vector3d::Constant(-100);
    Eigen::Affine3d patient_from_box = Eigen::Affine3d::Identity();
    patient_from_box.translation() = Eigen::Vector3d::Constant(-100);
    std::vector<float> distances_mm;
    for (int k = 0; k < 101; ++k) {
      for (int j = 0; j < 101; ++j) {
        for (int i = 0; i < 101; ++i)
          distances_mm.push_back(
              static_cast<float>((Eigen::Vector3d::Constant(-100) + 2 * Eigen::Vector3d(i, j, k)).norm() - radius_mm));
      }
    }
    return tissue_of(SignedDistance({101, 101, 101}, 2, patient_from_box, distances_mm), box, spacing_mm);
  }
};

/// A camera whose axis passes the ball's middle at so many mm, from another side each time.
VideoView looking_past(double aside_mm, double away_mm, int side) {
  VideoView view;
  view.name = "view";
  view.camera = testing::wide_lens(121, 91);
  view.camera_from_patient = {rotation_exp(Eigen::Vector3d(0.3 * side, 0.5 - 0.2 * side, 0.7 * side)),
                              Eigen::Vector3d(aside_mm, 0, away_mm)};
  view.mask.assign(121 * 91, 1);
  for (std::size_t i = 0; i < view.mask.size(); ++i) view.grey.push_back(static_cast<std::uint8_t>(i % 200));
  return view;
}

/// As a deformation that moves nothing has it.
std::vector<float> at_rest(const Tissue& tissue) {
  std::vector<float> depth_mm;
  warp(tissue, std::vector<float>(3 * tissue.depth_mm.size(), 0.0F), depth_mm);
  return depth_mm;
}

class SyntheticBall : public ::testing::TestWithParam<std::tuple<double, double>> {};

/// How far away a surface is drawn is told by a lamp that is moved along the ray: the nearer it is, the darker is what
/// it is taken to light here. Rays meet the surface straight, and at up to 53 degrees from that.
TEST_P(SyntheticBall, IsDrawnAsFarAwayAsItsBoundaryIs) {
  const Ball ball{std::get<0>(GetParam())};
  const Tissue tissue = ball.tissue(std::get<1>(GetParam()));
  const std::vector<float> depth_mm = at_rest(tissue);
  for (const double aside : {0.0, 0.4, 0.8}) {
    for (int side = 0; side < 6; ++side) {
      const VideoView looking = looking_past(aside * ball.radius_mm, ball.radius_mm + 50 + 0.31 * side, side);
      SyntheticView view(looking, tissue, 1);
      const Eigen::Vector3d ray = unproject(looking.camera, Eigen::Vector2d(60, 45))->normalized();
      const auto pixel = static_cast<std::size_t>(45 * 121 + 60);
      Headlight light;
      light.ambient = 1;
      light.vignette = 0;
      light.falloff = -2.2;  // grey grows with the distance itself
      constexpr double kMoved_mm = 10;
      const double from_lens = view.render(depth_mm, light)[pixel];
      light.offset_in_camera_mm = kMoved_mm * ray;
      const double from_before_it = view.render(depth_mm, light)[pixel];
      const double found_mm = kMoved_mm * from_lens / (from_lens - from_before_it);
      const Eigen::Vector3d middle_mm = looking.camera_from_patient.translation();
      const double along_mm = ray.dot(middle_mm), past_mm = ray.cross(middle_mm).norm();
      const double in_mm = std::sqrt(ball.radius_mm * ball.radius_mm - past_mm * past_mm);
      const double deeper_mm = (found_mm - along_mm + in_mm) * in_mm / ball.radius_mm;  // along the normal
      EXPECT_NEAR(deeper_mm, 0, 0.2) << aside << " " << side;
    }
  }
}

/// Half of the light is left of a ray that touches the boundary.
TEST_P(SyntheticBall, HasItsOutlineWhereRaysTouchItsBoundary) {
  const Ball ball{std::get<0>(GetParam())};
  const Tissue tissue = ball.tissue(std::get<1>(GetParam()));
  const std::vector<float> depth_mm = at_rest(tissue);
  Headlight light;
  light.ambient = 1;
  light.vignette = 0;
  light.falloff = 0;  // as bright everywhere
  for (int side = 0; side < 6; ++side) {
    const VideoView looking = looking_past(0, ball.radius_mm + 60 + side, side);
    SyntheticView view(looking, tissue, 1);
    const std::vector<double>& grey = view.render(depth_mm, light);
    const double half = 0.5 * (1 + kBackground);
    const auto passes_mm = [&](double column) {
      const Eigen::Vector3d ray = unproject(looking.camera, Eigen::Vector2d(column, 45))->normalized();
      return looking.camera_from_patient.translation().cross(ray).norm();
    };
    int outlines = 0;
    for (int column = 0; column < 120; ++column) {
      const double here = grey[static_cast<std::size_t>(45 * 121 + column)],
                   next = grey[static_cast<std::size_t>(45 * 121 + column + 1)];
      if ((here < half) == (next < half)) continue;
      ++outlines;
      EXPECT_NEAR(passes_mm(column + (half - here) / (next - here)), ball.radius_mm, 0.2) << side;
    }
    EXPECT_EQ(outlines, 2);
  }
}

INSTANTIATE_TEST_SUITE_P(Balls, SyntheticBall,
                         ::testing::Values(std::tuple(25.0, 3.0), std::tuple(25.0, 4.0), std::tuple(60.0, 3.0),
                                           std::tuple(60.0, 4.0)));

}  // namespace
}  // namespace birdseye::host
