#include "host/registration/views/view_registration.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "host/registration/views/synthetic_view.hpp"
#include "tests/support/lens.hpp"

namespace birdseye::host {
namespace {

using Parameters = std::vector<double>;

Parameters random_parameters(const ControlGrid& control, double most_mm, unsigned seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> uniform(-most_mm, most_mm);
  Parameters out(control.parameters());
  for (double& p : out) p = uniform(rng);
  return out;
}

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

/// An organ with a bump and a hollow, in air, on an oblique anisotropic grid.
Volume organ() {
  Volume v;
  v.size = {48, 44, 24};
  v.spacing_mm = {2, 2, 3};
  v.patient_from_voxel.linear() = rotation_exp(Eigen::Vector3d(0.2, -0.1, 0.3)) * v.spacing_mm.asDiagonal();
  v.patient_from_voxel.translation() = Eigen::Vector3d(-40, -35, -30);
  for (int k = 0; k < v.size[2]; ++k) {
    for (int j = 0; j < v.size[1]; ++j) {
      for (int i = 0; i < v.size[0]; ++i) {
        const Eigen::Vector3d p = Eigen::Vector3d(i, j, k).cwiseProduct(v.spacing_mm) - Eigen::Vector3d(46, 42, 34);
        const double body = p.cwiseQuotient(Eigen::Vector3d(30, 26, 20)).norm();
        const double bump = (p - Eigen::Vector3d(18, -8, -12)).norm() / 11;
        const double hollow = (p - Eigen::Vector3d(-6, 6, -20)).norm() / 9;
        v.hu.push_back(std::min(body, bump) < 1 && hollow > 1 ? 100 : -1000);
      }
    }
  }
  return v;
}

TransferFunction plain() {
  return TransferFunction({{-200, {1, 1, 1}, 0}, {0, {1, 1, 1}, 1}});
}

/// A view whose picture is smooth and has no more to do with the organ than that it is no constant.
VideoView view_from(const Eigen::Vector3d& turn) {
  VideoView view;
  view.name = std::string(1, 'v');
  view.camera = testing::wide_lens(96, 72);
  const Eigen::Matrix3d r = rotation_exp(turn);
  const Eigen::Vector3d middle = organ().patient_from_voxel * Eigen::Vector3d(23, 21, 11);
  view.camera_from_patient = {r, Eigen::Vector3d(0, 0, 95) - r * middle};
  for (int y = 0; y < 72; ++y) {
    for (int x = 0; x < 96; ++x) {
      const double r2 = std::hypot((x - 50) / 30.0, (y - 33) / 24.0);
      view.grey.push_back(static_cast<std::uint8_t>(40 + 180 * std::exp(-r2 * r2) + 0.3 * x));
    }
  }
  view.mask.assign(view.grey.size(), 1);
  return view;
}

TEST(ControlGrid, MorePointsMoveAlike) {
  const ControlGrid coarse({1, 2, 1}), fine({3, 3, 4});
  const Parameters p = random_parameters(coarse, 10, 1);
  std::vector<float> a, b;
  ControlledGrid(coarse, {7, 8, 9}).displacements(p, a);
  ControlledGrid(fine, {7, 8, 9}).displacements(coarse.refine(p, fine), b);
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-5F);
}

TEST(ControlGrid, MovesAsItsPatchDoes) {
  const ControlGrid control({3, 2, 1});
  const Parameters p = random_parameters(control, 10, 2);
  const Eigen::Vector3d box_mm(100, 80, 50);
  const BezierPatch patch = control.patch(p, box_mm);
  std::vector<float> moves;
  ControlledGrid(control, {5, 6, 4}).displacements(p, moves);
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 6; ++j) {
      for (int i = 0; i < 5; ++i) {
        const Eigen::Vector3d u = patch.displacement({i / 4.0, j / 5.0, k / 3.0}).cwiseProduct(box_mm);
        for (int axis = 0; axis < 3; ++axis)
          EXPECT_NEAR(u[axis],
                      static_cast<double>(moves[3 * grid_index({5, 6, 4}, i, j, k) + static_cast<std::size_t>(axis)]),
                      1e-4);
      }
    }
  }
}

TEST(ControlGrid, EvenCoordinatesMeasureTheDisplacement) {
  const ControlGrid control({3, 2, 4});
  const Parameters p = random_parameters(control, 10, 3);
  const Parameters even = control.to_even(p), back = control.from_even(even);
  for (std::size_t i = 0; i < p.size(); ++i) EXPECT_NEAR(back[i], p[i], 1e-9);
  // The mean of |u|^2 over the box, by the midpoints of many cells.
  const std::array<int, 3> n{61, 61, 61};
  std::vector<float> moves;
  ControlledGrid(control, n).displacements(p, moves);
  double mean = 0;
  for (const float u : moves)
    mean += static_cast<double>(u) * static_cast<double>(u) / (60.0 * 60 * 60);  // 0 at the faces
  EXPECT_NEAR(dot(even, even), mean, 1e-3 * mean);
}

TEST(ControlGrid, StrainHasItsGradient) {
  const ControlGrid control({3, 2, 2});
  const Eigen::Vector3d box_mm(120, 90, 70);
  const Parameters p = random_parameters(control, 10, 4);
  Parameters gradient(p.size(), 0.0), unused(p.size(), 0.0);
  EXPECT_GT(control.strain(p, box_mm, 2, gradient), 0);
  for (std::size_t i = 0; i < p.size(); i += 5) {
    Parameters up = p, down = p;
    up[i] += 1e-3;
    down[i] -= 1e-3;
    const double slope = 2 * (control.strain(up, box_mm, 0, unused) - control.strain(down, box_mm, 0, unused)) / 2e-3;
    EXPECT_NEAR(gradient[i], slope, 1e-9 + 1e-6 * std::abs(slope));
  }
}

TEST(ControlledGrid, PullsBackByItsTranspose) {
  const ControlGrid control({2, 3, 1});
  const std::array<int, 3> n{9, 7, 8};
  const ControlledGrid grid(control, n);
  const Parameters p = random_parameters(control, 5, 5);
  std::vector<float> moves, weights(3 * grid_count(n));
  grid.displacements(p, moves);
  std::mt19937 rng(6);
  std::normal_distribution<float> normal;
  for (float& w : weights) w = normal(rng);
  double there = 0;
  for (std::size_t i = 0; i < moves.size(); ++i)
    there += static_cast<double>(moves[i]) * static_cast<double>(weights[i]);
  Parameters back(p.size(), 0.0);
  grid.pull_back(weights, back);
  EXPECT_NEAR(dot(p, back), there, 1e-4 * std::abs(there));
}

/// Of the organ, lit from beside the lens.
struct ThreeViews {
  Tissue tissue = *tissue_of(organ(), nullptr, {}, plain(), 4);
  ControlGrid control = ControlGrid({2, 2, 2});
  Headlight light = {{5, -3, 0}};
  MultiView multi = *MultiView::make({view_from({0, 0, 0}), view_from({0.4, 0.2, 0}), view_from({-0.3, 0.5, 1})},
                                     tissue, control, 1, {});
};

/// The gradient of all views' similarity, through information, compositing, light, sampling and the Bezier map.
TEST(MultiView, GradientAgreesWithCentralDifferences) {
  ThreeViews at_organ;
  const ControlGrid& control = at_organ.control;
  const Headlight& light = at_organ.light;
  MultiView* const multi = &at_organ.multi;
  std::mt19937 rng(7);
  std::normal_distribution<double> normal;
  for (unsigned trial = 0; trial < 4; ++trial) {
    const Parameters p = random_parameters(control, 6, 10 + trial);
    Parameters gradient;
    multi->value_and_gradient(p, light, gradient);
    // Along the gradient and at random to it.
    Parameters along = gradient;
    if (trial % 2 == 1) {
      for (double& a : along)
        a += normal(rng) * std::sqrt(dot(gradient, gradient) / static_cast<double>(gradient.size()));
    }
    const double length = std::sqrt(dot(along, along));
    for (double& a : along) a /= length;
    const auto at = [&](double step) {
      Parameters q = p;
      for (std::size_t i = 0; i < q.size(); ++i) q[i] += step * along[i];
      return multi->value(q, light);
    };
    constexpr double kStep = 0.1;
    const double slope = (8 * (at(kStep) - at(-kStep)) - (at(2 * kStep) - at(-2 * kStep))) / (12 * kStep);
    EXPECT_NEAR(dot(gradient, along), slope, 1e-3 * std::sqrt(dot(gradient, gradient))) << trial;
  }
}

/// With respect to a motion of all cameras, at poses and deformations far from the start. Steps are small, for blends
/// between the grid's points have kinks where a sample goes from one cell to the next.
TEST(MultiView, PoseGradientAgreesWithCentralDifferences) {
  ThreeViews at_organ;
  const ControlGrid& control = at_organ.control;
  const Headlight& light = at_organ.light;
  MultiView* const multi = &at_organ.multi;
  std::mt19937 rng(8);
  std::uniform_real_distribution<double> uniform(-4, 4);
  for (unsigned trial = 0; trial < 4; ++trial) {
    const Parameters p = random_parameters(control, 6, 30 + trial);
    PoseUnknowns pose{}, gradient{};
    for (double& x : pose) x = uniform(rng);
    multi->set_pose(pose);
    Parameters unused;
    multi->value_and_gradient(p, light, unused, &gradient);
    const double length = std::sqrt(std::inner_product(gradient.begin(), gradient.end(), gradient.begin(), 0.0));
    for (std::size_t axis = 0; axis < pose.size(); ++axis) {
      const auto at = [&](double step) {
        PoseUnknowns moved = pose;
        moved[axis] += step;
        multi->set_pose(moved);
        return multi->value(p, light);
      };
      constexpr double kStep_mm = 0.0025;
      const double slope = (at(kStep_mm) - at(-kStep_mm)) / (2 * kStep_mm);
      EXPECT_NEAR(gradient[axis], slope, 1e-3 * length) << trial << " " << axis;
    }
  }
}

TEST(RigidMotion, TurnsAboutTheOrgansCentreAndShifts) {
  const auto tissue = tissue_of(organ(), nullptr, {}, plain(), 4);
  ASSERT_TRUE(tissue);
  const RigidMotion motion(*tissue);
  const double r = motion.gyration_mm();
  EXPECT_GT(r, 15);
  EXPECT_LT(r, 30);
  const auto patient_from_model = motion.patient_from_model({1, 2, 3, 0.1 * r, 0, 0});
  EXPECT_NEAR((patient_from_model * motion.centre_mm() - motion.centre_mm() - Eigen::Vector3d(1, 2, 3)).norm(), 0,
              1e-12);
  EXPECT_NEAR((rotation_log(patient_from_model.rotation()) - Eigen::Vector3d(0.1, 0, 0)).norm(), 0, 1e-12);
}

TEST(MultiView, IsTheSameToTheBitEveryTime) {
  const auto tissue = tissue_of(organ(), nullptr, {}, plain(), 4);
  ASSERT_TRUE(tissue);
  const ControlGrid control({2, 2, 2});
  auto multi = MultiView::make({view_from({0, 0, 0}), view_from({0.4, 0.2, 0})}, *tissue, control, 1, {});
  ASSERT_TRUE(multi);
  const Parameters p = random_parameters(control, 6, 20);
  Parameters a, b;
  const double value = multi->value_and_gradient(p, {}, a);
  EXPECT_EQ(multi->value_and_gradient(p, {}, b), value);
  EXPECT_EQ(a, b);
  EXPECT_EQ(multi->value(p, {}), value);
}

TEST(Tissue, RefusesWhatIsNotSeen) {
  const Volume v = organ();
  const TransferFunction nothing({{-1024, {1, 1, 1}, 0}});
  EXPECT_FALSE(tissue_of(v, nullptr, {}, nothing, 4));
  Volume sheared = v;
  sheared.patient_from_voxel.linear().col(0) += 0.2 * sheared.patient_from_voxel.linear().col(1);
  EXPECT_FALSE(tissue_of(sheared, nullptr, {}, plain(), 4));
}

/// A prior that allows no deformation at all, and a start that explains the views exactly: what is found is worse, and
/// what is returned is the start.
TEST(RegisterViews, KeepsAStartThatIsBetter) {
  const auto tissue = tissue_of(organ(), nullptr, {}, plain(), 2);
  ASSERT_TRUE(tissue);
  const ControlGrid control({1, 1, 1});
  const Parameters moved{20, -12, 8};
  std::vector<float> moves, warped;
  ControlledGrid(control, tissue->points).displacements(moved, moves);
  warp(*tissue, moves, warped);
  std::vector<VideoView> views{view_from({0, 0, 0}), view_from({0.4, 0.2, 0})};
  for (VideoView& view : views) {
    SyntheticView synthetic(view, *tissue, 1);
    const std::vector<double>& grey = synthetic.render(warped, {});
    for (std::size_t i = 0; i < grey.size(); ++i)
      view.grey[i] = static_cast<std::uint8_t>(std::clamp(200 * grey[i] + 50, 0.0, 255.0));
  }
  PatchOctree tree = *PatchOctree::uniform(3);
  control.patch(moved, tissue->box_mm()).drive(tree);
  Eigen::Affine3d patient_from_cube = tissue->patient_from_grid;
  patient_from_cube.scale(tissue->box_mm());
  ViewRegistrationSettings settings;
  settings.control_points = {1, 1, 1};
  settings.level = 3;
  settings.initial = field_of(tree, patient_from_cube);
  settings.light = Headlight{};
  settings.prior.strain = 1e9;
  const auto found = register_views(views, organ(), nullptr, {}, plain(), settings);
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_TRUE(found->worse_than_start);
  EXPECT_EQ(found->similarity_after, found->similarity_before);
  for (std::size_t i = 0; i < moved.size(); ++i) EXPECT_NEAR(found->parameters[i], moved[i], 0.2);
}

TEST(HeldOutGain, IsOfAMotionWhereItIsWorthwhile) {
  EXPECT_TRUE((HeldOutGain{-0.01, 0.001}.nothing_moved()));
  EXPECT_TRUE((HeldOutGain{0.0039, 0.0001}.nothing_moved()));
  EXPECT_FALSE((HeldOutGain{-0.012, 0.021}.nothing_moved())) << "views that are at odds";
  // One view sees most of what moved.
  EXPECT_FALSE((HeldOutGain{0.15, 0.12}.nothing_moved()));
}

TEST(RegisterViews, RefusesAViewThatSeesNothing) {
  VideoView away = view_from({0, 0, 0});
  away.name = std::string("away.png");
  away.camera_from_patient = {rotation_exp(Eigen::Vector3d(0, 3, 0)), Eigen::Vector3d(0, 0, -300)};
  ViewRegistrationSettings settings;
  settings.control_points = {1, 1, 1};
  const auto found = register_views({view_from({0, 0, 0}), away}, organ(), nullptr, {}, plain(), settings);
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().what.find("away.png"), std::string::npos) << found.error().what;
}

}  // namespace
}  // namespace birdseye::host
