#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "host/render/cpu/ray_caster.hpp"
#include "host/render/reference/reference_renderer.hpp"
#include "tests/support/render_scene.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using testing::bent;
using testing::lens;
using testing::pose;
using testing::scene;
using testing::soft;

void expect_agreement(const Volume& volume, const RenderSettings& settings,
                      const DisplacementField* deformation = nullptr,
                      const std::optional<Transform<Camera, Patient>>& seen_from = std::nullopt,
                      double most_mean = 0.1) {
  const Transform<Camera, Patient> from = seen_from.value_or(pose(volume));
  const std::vector<double> reference = render_reference(volume, soft(), lens(), from, settings, deformation);
  EXPECT_GT(*std::max_element(reference.begin(), reference.end()), 0.4);
  for (const cpu::Isa isa : cpu::supported_isas()) {
    RayCaster caster(volume, soft(), isa);
    if (deformation != nullptr) caster.deform(*deformation);
    const ImageRgba picture = caster.render(LensRays(lens()), from, settings);
    const auto d = testing::difference(picture, reference);
    EXPECT_LT(d.mean, most_mean) << cpu::name_of(isa);
    EXPECT_LT(d.worst, 3) << cpu::name_of(isa);
  }
}

TEST(RayCaster, AgreesWithTheReference) {
  RenderSettings settings;
  settings.step_mm = 0.8;
  expect_agreement(scene(), settings);
}

TEST(RayCaster, DrawsNothingFromWhereSinglePrecisionEnds) {
  const Volume volume = scene();
  for (const cpu::Isa isa : cpu::supported_isas()) {
    RayCaster caster(volume, soft(), isa);
    for (const double far_mm :
         {1e8, 1e38, 1e308, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
      const Transform<Camera, Patient> from(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, -far_mm, 100));
      const ImageRgba picture = caster.render(LensRays(lens()), from, {});
      EXPECT_EQ(std::ranges::count(picture.rgba, 0), std::ssize(picture.rgba)) << far_mm;
    }
  }
}

TEST(RayCaster, AgreesWithTheReferenceWhenClippedAndFromInside) {
  const Volume volume = scene();
  RenderSettings settings;
  settings.near_mm = 95;
  settings.clip = ClipPlane{Eigen::Vector3d(1, 0.3, -0.2).normalized(), 0};
  settings.clip->offset_mm = settings.clip->normal.dot(volume.patient_from_voxel * Eigen::Vector3d(18, 17, 15));
  expect_agreement(volume, settings);
}

TEST(RayCaster, AgreesWithTheReferenceWhenDeformed) {
  const Volume volume = scene();
  RenderSettings settings;
  settings.step_mm = 0.8;
  const DisplacementField coarse = bent(volume, 1, 0.2, 3);
  const DisplacementField fine = bent(volume, 3, 0.03, 4);
  expect_agreement(volume, settings, &coarse);
  expect_agreement(volume, settings, &fine);
}

TEST(RayCaster, AgreesWithTheReferenceUnderAFieldOnAGridOfItsOwn) {
  // Turned against the volume, and over a part of it only.
  const Volume volume = scene();
  DisplacementField field;
  field.size = {9, 7, 8};
  field.patient_from_lattice.linear() = 6 * rotation_exp(Eigen::Vector3d(0.5, 0.2, -0.3));
  field.patient_from_lattice.translation() = volume.patient_from_voxel * Eigen::Vector3d(20, 18, 15) -
                                             field.patient_from_lattice.linear() * Eigen::Vector3d(4, 3, 3.5);
  for (int n = 0; n < 9 * 7 * 8; ++n) {
    const bool inner = n % 9 > 0 && n % 9 < 8 && n / 9 % 7 > 0 && n / 9 % 7 < 6 && n / 63 > 0 && n / 63 < 7;
    field.displacement_mm.emplace_back(inner ? Eigen::Vector3f(3.0F, -2.0F * static_cast<float>(n % 2), 1.5F)
                                             : Eigen::Vector3f(0, 0, 0));
  }
  RenderSettings settings;
  settings.step_mm = 0.8;
  expect_agreement(volume, settings, &field);
}

TEST(RayCaster, PruningChangesTheTimeNotThePicture) {
  const Volume volume = scene();
  const LensRays rays(lens());
  for (const double amount : {0.0, 0.2}) {
    RayCaster pruned(volume, soft()), whole(volume, soft(), cpu::supported_isas().back(), false);
    const DisplacementField field = bent(volume, 2, amount, 7);
    pruned.deform(field);
    whole.deform(field);
    EXPECT_EQ(pruned.render(rays, pose(volume), {}).rgba, whole.render(rays, pose(volume), {}).rgba) << amount;
    // From within the volume, with bricks beside the camera and behind it.
    const Eigen::Vector3d eye = volume.patient_from_voxel * Eigen::Vector3d(12, 15, 9);
    const Transform<Camera, Patient> inside(pose(volume).rotation(), -(pose(volume).rotation() * eye));
    EXPECT_EQ(pruned.render(rays, inside, {}).rgba, whole.render(rays, inside, {}).rgba) << amount;
  }
}

TEST(RayCaster, ForgetsOneDeformationForTheNext) {
  const Volume volume = scene();
  const LensRays rays(lens());
  RayCaster caster(volume, soft()), fresh(volume, soft());
  const ImageRgba scanned = caster.render(rays, pose(volume), {});
  caster.deform(bent(volume, 1, 0.25, 5));
  const DisplacementField second = bent(volume, 2, 0.1, 6);
  caster.deform(second);
  fresh.deform(second);
  EXPECT_EQ(caster.render(rays, pose(volume), {}).rgba, fresh.render(rays, pose(volume), {}).rgba);
  caster.undeform();
  EXPECT_EQ(caster.render(rays, pose(volume), {}).rgba, scanned.rgba);
}

TEST(RayCaster, AgreesWithTheReferenceFromAnywhere) {
  const Volume volume = scene();
  std::mt19937 rng(12);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int n = 0; n < 6; ++n) {
    const Eigen::Matrix3d r = rotation_exp(3 * Eigen::Vector3d(uniform(rng), uniform(rng), uniform(rng)));
    const Eigen::Vector3d middle = volume.patient_from_voxel * Eigen::Vector3d(20, 18, 15);
    RenderSettings settings;
    settings.step_mm = 0.5 + 0.5 * std::abs(uniform(rng));
    const DisplacementField field = bent(volume, 1 + n % 4, n % 4 == 0 ? 0.2 : 0.02, 20U + static_cast<unsigned>(n));
    const Transform<Camera, Patient> from(r, Eigen::Vector3d(0, 0, 60 + 50 * std::abs(uniform(rng))) - r * middle);
    expect_agreement(volume, settings, n % 2 == 0 ? &field : nullptr, from);
  }
}

TEST(RayCaster, AgreesWithTheReferenceFromWithinTheVolume) {
  const Volume volume = scene();
  const Eigen::Matrix3d r = pose(volume).rotation();
  const DisplacementField field = bent(volume, 2, 0.1, 8);
  for (const Eigen::Vector3d& voxel : {Eigen::Vector3d(12, 15, 9), Eigen::Vector3d(20, 18, 15)}) {
    const Transform<Camera, Patient> from(r, -(r * (volume.patient_from_voxel * voxel)));
    // The picture is full then, and rounding a pixel to 8 bits alone is 0.25 on average.
    expect_agreement(volume, {}, voxel.x() > 15 ? &field : nullptr, from, 0.5);
  }
}

TEST(RayCaster, ADeformationOfNothingChangesNothing) {
  const Volume volume = scene();
  const DisplacementField nothing = bent(volume, 2, 0, 1);
  RayCaster caster(volume, soft());
  const LensRays rays(lens());
  const ImageRgba scanned = caster.render(rays, pose(volume), {});
  caster.deform(nothing);
  EXPECT_EQ(caster.render(rays, pose(volume), {}).rgba, scanned.rgba);
}

TEST(RayCaster, ADeformationOfNothingChangesNothingWhereAirIsSeenAndStepsAreLong) {
  const Volume volume = scene();
  const TransferFunction air({{-900, {0.5, 0.6, 0.9}, 0.05}, {-850, {0.5, 0.6, 0.9}, 0}});
  const DisplacementField nothing = bent(volume, 2, 0, 1);
  const LensRays rays(lens());
  for (const double step_mm : {0.7, 3.0, 6.0}) {
    RenderSettings settings;
    settings.step_mm = step_mm;
    RayCaster caster(volume, air);
    const ImageRgba scanned = caster.render(rays, pose(volume), settings);
    caster.deform(nothing);
    EXPECT_EQ(caster.render(rays, pose(volume), settings).rgba, scanned.rgba) << step_mm;
  }
}

TEST(RayCaster, DoesNotDriftAlongAMillionSteps) {
  // The end of a long ray is where it is said to be: the last slices are dense, all before them nearly clear.
  Volume volume;
  volume.size = {8, 8, 1000};
  volume.spacing_mm = {1, 1, 700};
  volume.patient_from_voxel.linear() = volume.spacing_mm.asDiagonal();
  volume.hu.assign(8 * 8 * 1000, 0);
  std::fill(volume.hu.end() - std::ptrdiff_t{8 * 8 * 2}, volume.hu.end(), std::int16_t{1000});
  const TransferFunction fog({{0, {1, 0, 0}, 1e-9}, {900, {0, 1, 0}, 0.01}});
  CameraModel camera;
  camera.width_px = camera.height_px = 4;
  camera.fx_px = camera.fy_px = 1e7;
  camera.cx_px = camera.cy_px = 1.5;
  const Transform<Camera, Patient> from(Eigen::Matrix3d::Identity(), Eigen::Vector3d(-3.5, -3.5, 100));
  const std::vector<double> reference = render_reference(volume, fog, camera, from, {}, nullptr);
  for (const cpu::Isa isa : cpu::supported_isas()) {
    const ImageRgba picture = RayCaster(volume, fog, isa).render(LensRays(camera), from, {});
    EXPECT_LT(testing::difference(picture, reference).worst, 3) << cpu::name_of(isa);
  }
}

TEST(RayCaster, AnEmptyVolumeIsTransparent) {
  Volume volume = scene();
  std::fill(volume.hu.begin(), volume.hu.end(), std::int16_t{-1000});
  const ImageRgba picture = RayCaster(volume, soft()).render(LensRays(lens()), pose(volume), {});
  EXPECT_EQ(std::count(picture.rgba.begin(), picture.rgba.end(), 0), static_cast<std::ptrdiff_t>(picture.rgba.size()));
}

TEST(RayCaster, IsTheSameToTheBitForAnyNumberOfThreads) {
  const Volume volume = scene();
  RayCaster caster(volume, soft());
  const LensRays rays(lens());
  const ImageRgba many = caster.render(rays, pose(volume), {});
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(caster.render(rays, pose(volume), {}).rgba, many.rgba);
}

TEST(RayCaster, DoesNotCareWhereThePatientLies) {
  const Volume volume = scene();
  Volume moved = volume;
  const Transform<Patient, Patient> move(rotation_exp(Eigen::Vector3d(1, -2, 0.5)), Eigen::Vector3d(40, -70, 15));
  moved.patient_from_voxel.matrix() = move.matrix() * volume.patient_from_voxel.matrix();
  const LensRays rays(lens());
  const ImageRgba a = RayCaster(volume, soft()).render(rays, pose(volume), {});
  const ImageRgba b = RayCaster(moved, soft()).render(rays, pose(volume) * move.inverse(), {});
  int differ = 0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) {
    EXPECT_LE(std::abs(a.rgba[i] - b.rgba[i]), 2);
    if (a.rgba[i] != b.rgba[i]) ++differ;
  }
  EXPECT_LT(differ, static_cast<int>(a.rgba.size() / 20));
}

TEST(RayCaster, PutsAVoxelWhereTheLensProjectsIt) {
  Volume volume = scene();
  std::fill(volume.hu.begin(), volume.hu.end(), std::int16_t{-1000});
  for (int d = 0; d < 8; ++d) volume.hu[volume.index(30 + (d & 1), 8 + (d >> 1 & 1), 20 + (d >> 2))] = 3000;
  const ImageRgba picture = RayCaster(volume, soft()).render(LensRays(lens()), pose(volume), {});
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double weight = 0;
  for (int y = 0; y < lens().height_px; ++y) {
    for (int x = 0; x < lens().width_px; ++x) {
      const double w = picture.rgba[static_cast<std::size_t>(y * lens().width_px + x) * 4 + 3];
      sum += w * Eigen::Vector2d(x, y);
      weight += w;
    }
  }
  ASSERT_GT(weight, 0);
  const auto expected = project(lens(), pose(volume) * (volume.patient_from_voxel * Eigen::Vector3d(30.5, 8.5, 20.5)));
  EXPECT_LT((sum / weight - *expected).norm(), 0.1);
}

TEST(TransferFunction, ReadsPresetsAndNamesWhatItDoesNotKnow) {
  for (const std::string& name : transfer_presets()) EXPECT_TRUE(load_transfer_function(name)) << name;
  const auto unknown = load_transfer_function("livre");
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().what.find("liver"), std::string::npos);
  EXPECT_NEAR(static_cast<double>(soft().at(100).extinction_per_mm), 0.125, 1e-6);
  EXPECT_FALSE(soft().any_seen(-1024, -400));
  EXPECT_TRUE(soft().any_seen(-1024, -399));
}

TEST(TransferFunction, AFileThatSaysAKeyTwiceOrHasNoArrayIsRefused) {
  const testing::Scratch scratch;
  const std::string point = R"({"hu": 10, "rgb": [1, 1, 1], "extinction_per_mm": 0.1)";
  EXPECT_TRUE(load_transfer_function(scratch.file("good.json", R"({"points": [)" + point + "}]}")));
  for (const auto& [name, text, why] : std::vector<std::array<std::string, 3>>{
           {"twice.json", R"({"points": [)" + point + R"(, "extinction_per_mm": 2}]})",
            "\"extinction_per_mm\" stands twice in it"},
           {"object.json", R"({"points": {"a": )" + point + "}}}", "points is no array"},
           {"cut.json", R"({"points": [)", "is not a transfer function in JSON"}}) {
    const auto read = load_transfer_function(scratch.file(name, text));
    ASSERT_FALSE(read) << name;
    EXPECT_NE(read.error().what.find(name + ": " + why), std::string::npos) << read.error().what;
  }
}

TEST(OnGrey, IsTheGreyWhereNothingIsDrawnAndBlendsWhereSomethingIs) {
  const ImageRgba image{4, 1, {0, 0, 0, 0, 64, 0, 0, 128, 255, 255, 255, 255, 10, 20, 30, 255}};
  EXPECT_EQ(on_grey(image, 50), (std::vector<std::uint8_t>{50, 50, 50, 89, 25, 25, 255, 255, 255, 10, 20, 30}));
}

}  // namespace
}  // namespace birdseye::host
