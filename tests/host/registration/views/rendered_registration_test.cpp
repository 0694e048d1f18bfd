#include "host/registration/views/rendered_registration.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/registration/views/direction_set.hpp"
#include "tests/support/lens.hpp"

namespace birdseye::host {
namespace {

/// An organ with a bump, in air.
Volume rendered_organ() {
  Volume v;
  v.size = {60, 54, 40};
  v.spacing_mm = {2, 2, 2.5};
  v.patient_from_voxel.linear() = v.spacing_mm.asDiagonal();
  v.patient_from_voxel.translation() = Eigen::Vector3d(-60, -54, -50);
  for (int k = 0; k < v.size[2]; ++k) {
    for (int j = 0; j < v.size[1]; ++j) {
      for (int i = 0; i < v.size[0]; ++i) {
        const Eigen::Vector3d p = v.patient_from_voxel * Eigen::Vector3d(i, j, k);
        const double body = p.cwiseQuotient(Eigen::Vector3d(36, 28, 26)).norm();
        const double bump = (p - Eigen::Vector3d(20, -12, -18)).norm() / 13;
        v.hu.push_back(std::min(body, bump) < 1 ? 100 : -1000);
      }
    }
  }
  return v;
}

TransferFunction plain_transfer() {
  return TransferFunction({{-200, {1, 1, 1}, 0}, {0, {1, 1, 1}, 1}});
}

DisplacementField moved_by(const std::vector<double>& parameters, const Volume& volume) {
  PatchOctree tree = *PatchOctree::uniform(4);
  const Eigen::Vector3d box_mm =
      volume.spacing_mm.cwiseProduct(Eigen::Vector3d(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1));
  ControlGrid({1, 1, 1}).patch(parameters, box_mm).drive(tree);
  Eigen::Affine3d patient_from_cube =
      Eigen::Translation3d(volume.patient_from_voxel.translation()) * Eigen::Affine3d(Eigen::Scaling(box_mm));
  return field_of(tree, patient_from_cube);
}

/// What a camera sees of the volume itself, deformed: no shell, another light, a sloping background.
std::vector<VideoView> views_of(const Volume& volume, const DisplacementField& field) {
  RayCaster caster(volume, TransferFunction({{-300, {1, 0.5, 0.4}, 0}, {0, {1, 0.5, 0.4}, 2}}));
  caster.deform(field);
  std::vector<VideoView> views;
  for (const Eigen::Vector3d& turn :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.6, 0.2, 0.1), Eigen::Vector3d(-0.2, 0.7, 0.4)}) {
    VideoView view;
    view.name = "view";
    view.camera = testing::wide_lens(192, 144);
    view.camera_from_patient = {rotation_exp(turn), Eigen::Vector3d(0, 0, 110)};
    const ImageRgba picture = caster.render(LensRays(view.camera), view.camera_from_patient, {});
    for (std::size_t i = 0; i < picture.rgba.size(); i += 4) {
      const bool tissue = picture.rgba[i + 3] > 128;
      view.grey.push_back(tissue ? picture.rgba[i] : static_cast<std::uint8_t>(10 + i / 4 % 192 / 8));
    }
    view.mask.assign(view.grey.size(), 1);
    views.push_back(std::move(view));
  }
  return views;
}

double mean_distance_mm(const DisplacementField& a, const DisplacementField& b) {
  double sum = 0;
  int count = 0;
  for (int x = -30; x <= 30; x += 10) {
    for (int y = -20; y <= 20; y += 10) {
      const Eigen::Vector3d p(x, y, -20);
      sum += (a.displacement(p) - b.displacement(p)).norm();
      ++count;
    }
  }
  return sum / count;
}

struct Kind {
  DirectOptimiser optimiser;
  bool vertices;
};

class RegisterRendered : public ::testing::TestWithParam<Kind> {};

TEST_P(RegisterRendered, FindsADeformation) {
  const Volume volume = rendered_organ();
  const DisplacementField truth = moved_by({40, -35, 30}, volume);
  const DisplacementField none = moved_by({0, 0, 0}, volume);
  RenderedRegistrationSettings settings;
  settings.optimiser = GetParam().optimiser;
  settings.vertices = GetParam().vertices;
  settings.level = settings.vertices ? 1 : 4;
  settings.most_evaluations = 100;
  const auto found = register_rendered(views_of(volume, truth), volume, nullptr, {}, plain_transfer(), settings);
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_GT(mean_distance_mm(none, truth), 4);
  // A single vertex bends its neighbourhood otherwise than a control point does.
  EXPECT_LT(mean_distance_mm(found->field, truth), settings.vertices ? 2.0 : 0.7);
  EXPECT_GT(found->similarity_after, found->similarity_before + 0.05);
  EXPECT_FALSE(found->worse_than_start);
  EXPECT_GT(found->min_jacobian, 0);
  EXPECT_EQ(found->parameters.size(), 3U);
  EXPECT_EQ(found->per_view_after.size(), 3U);
  EXPECT_LE(found->evaluations, settings.most_evaluations);
  EXPECT_EQ(found->trace.size(), static_cast<std::size_t>(found->evaluations));
}

INSTANTIATE_TEST_SUITE_P(Kinds, RegisterRendered,
                         ::testing::Values(Kind{DirectOptimiser::simplex, false}, Kind{DirectOptimiser::powell, false},
                                           Kind{DirectOptimiser::simplex, true}));

TEST(RegisterRendered, StaysWhereNothingIsBetter) {
  const Volume volume = rendered_organ();
  const DisplacementField truth = moved_by({40, -35, 30}, volume);
  RenderedRegistrationSettings settings;
  settings.initial = truth;
  settings.level = 4;
  settings.most_evaluations = 4;
  settings.first_step_mm = 200;  // which folds
  const auto found = register_rendered(views_of(volume, truth), volume, nullptr, {}, plain_transfer(), settings);
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_TRUE(found->worse_than_start);
  EXPECT_LT(mean_distance_mm(found->field, truth), 0.1);
  EXPECT_EQ(found->similarity_after, found->similarity_before);
  EXPECT_GT(found->min_jacobian, 0);
  EXPECT_LT(found->trace.back().similarity, -1) << "what folds is worth less than all else";
}

TEST(RegisterRendered, RefusesWhatCannotBeUsed) {
  const Volume volume = rendered_organ();
  std::vector<VideoView> views = views_of(volume, moved_by({0, 0, 0}, volume));
  RenderedRegistrationSettings settings;
  EXPECT_FALSE(register_rendered({}, volume, nullptr, {}, plain_transfer(), settings));
  settings.similarity = "taste";
  EXPECT_FALSE(register_rendered(views, volume, nullptr, {}, plain_transfer(), settings));
  settings.similarity = "mi";
  settings.level = 9;
  EXPECT_FALSE(register_rendered(views, volume, nullptr, {}, plain_transfer(), settings));
  settings.level = 3;
  settings.initial = moved_by({2000, 0, 0}, volume);
  EXPECT_FALSE(register_rendered(views, volume, nullptr, {}, plain_transfer(), settings));
  settings.initial.reset();
  views[1].name = "away.png";
  views[1].camera_from_patient = {rotation_exp(Eigen::Vector3d(0, 3, 0)), Eigen::Vector3d(0, 0, -300)};
  const auto found = register_rendered(views, volume, nullptr, {}, plain_transfer(), settings);
  ASSERT_FALSE(found);
  EXPECT_NE(found.error().what.find("away.png"), std::string::npos) << found.error().what;
}

TEST(DirectionSet, ClimbsARoundedRidge) {
  // The top of a long oblique ridge.
  const auto value = [](const std::vector<double>& x) {
    const double along = x[0] + x[1] - 3, across = 4 * (x[0] - x[1]) - x[2];
    return -std::sqrt(1 + along * along + across * across + (x[2] - 2) * (x[2] - 2));
  };
  int asked = 0;
  const auto counted = [&](const std::vector<double>& x) {
    ++asked;
    return value(x);
  };
  const std::vector<double> top = climb_by_direction_set(counted, {0, 0, 0}, 1, 0.01);
  EXPECT_NEAR(top[2], 2, 0.1);
  EXPECT_NEAR(top[0] + top[1], 3, 0.1);
  EXPECT_LT(asked, 200);
}

/// Pictures of one deformation do not depend on what was drawn before it.
TEST(RenderedViews, AreTheSameToTheBitEveryTime) {
  const Volume volume = rendered_organ();
  const DisplacementField a = moved_by({40, -35, 30}, volume), b = moved_by({-20, 10, 5}, volume);
  const auto tissue = tissue_of(volume, nullptr, {}, plain_transfer(), 2);
  ASSERT_TRUE(tissue);
  auto views = RenderedViews::make(views_of(volume, a), *tissue, "mi");
  ASSERT_TRUE(views);
  const double first = views->similarity(a);
  EXPECT_LT(views->similarity(b), first);
  EXPECT_EQ(views->similarity(a), first);
}

}  // namespace
}  // namespace birdseye::host
