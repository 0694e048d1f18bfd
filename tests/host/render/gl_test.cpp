#include <gtest/gtest.h>

#include "host/render/cpu/ray_caster.hpp"
#include "host/render/engine.hpp"
#include "host/render/gl/gl_ray_caster.hpp"
#include "host/render/gl/gl_slice_renderer.hpp"
#include "tests/support/render_scene.hpp"

namespace birdseye::host {
namespace {

using testing::bent;
using testing::difference;
using testing::lens;
using testing::pose;
using testing::scene;
using testing::soft;

/// A driver is among the packages, so that none is a failure and no reason to skip.
std::unique_ptr<GlContext> offscreen() {
  auto context = GlContext::offscreen();
  EXPECT_TRUE(context) << context.error().what;
  return context ? *std::move(context) : nullptr;
}

TEST(GlRayCaster, AgreesWithTheReferenceScannedAndDeformed) {
  const auto context = offscreen();
  ASSERT_NE(context, nullptr);
  const Volume volume = scene();
  auto caster = GlRayCaster::create(*context, volume, soft());
  ASSERT_TRUE(caster) << caster.error().what;
  RenderSettings settings;
  settings.step_mm = 0.8;
  const auto check = [&](const DisplacementField* field) {
    const auto d = difference((*caster)->render(lens(), pose(volume), settings),
                              render_reference(volume, soft(), lens(), pose(volume), settings, field));
    EXPECT_LT(d.mean, 0.5);
    EXPECT_LT(d.worst, 6);
  };
  check(nullptr);
  for (const auto& [level, amount] : {std::pair{1, 0.2}, {3, 0.03}}) {
    const DisplacementField field = bent(volume, level, amount, 3);
    (*caster)->deform(field);
    check(&field);
  }
  (*caster)->undeform();
  check(nullptr);
  settings.near_mm = 95;
  settings.clip = ClipPlane{Eigen::Vector3d(1, 0.3, -0.2).normalized(), 0};
  settings.clip->offset_mm = settings.clip->normal.dot(volume.patient_from_voxel * Eigen::Vector3d(18, 17, 15));
  check(nullptr);
  EXPECT_EQ(context->fault(), "");
}

TEST(GlSliceRenderer, IsLikeTheReferenceScannedAndDeformed) {
  const auto context = offscreen();
  ASSERT_NE(context, nullptr);
  const Volume volume = scene();
  auto slices = GlSliceRenderer::create(*context, volume, soft());
  ASSERT_TRUE(slices) << slices.error().what;
  RenderSettings settings;
  settings.step_mm = 0.5;
  const auto check = [&](const DisplacementField* field) {
    const auto d = difference((*slices)->render(lens(), pose(volume), settings),
                              render_reference(volume, soft(), lens(), pose(volume), settings, field));
    EXPECT_LT(d.mean, 3);
  };
  check(nullptr);
  const DisplacementField field = bent(volume, 1, 0.2, 3);
  (*slices)->deform(field);
  check(&field);
  EXPECT_EQ(context->fault(), "");
}

TEST(GlRayCaster, DrawsNothingOfAnEmptyVolume) {
  const auto context = offscreen();
  ASSERT_NE(context, nullptr);
  Volume volume = scene();
  std::fill(volume.hu.begin(), volume.hu.end(), std::int16_t{-1000});
  auto caster = GlRayCaster::create(*context, volume, soft());
  ASSERT_TRUE(caster) << caster.error().what;
  const ImageRgba picture = (*caster)->render(lens(), pose(volume), {});
  EXPECT_EQ(std::count(picture.rgba.begin(), picture.rgba.end(), 0), static_cast<std::ptrdiff_t>(picture.rgba.size()));
  EXPECT_EQ(context->fault(), "");
}

TEST(Engine, EveryOneRefusesAVolumeBeyondMemory) {
  Volume volume;
  volume.size = {40'000, 40'000, 40'000};  // its voxels are not asked for
  for (const std::string& name : engine_names()) {
    const auto engine = make_engine(name, volume, soft());
    ASSERT_FALSE(engine) << name;
    EXPECT_EQ(engine.error().code, Errc::unsupported);
    EXPECT_NE(engine.error().what.find("40000x40000x40000 needs 512000.0 GB"), std::string::npos)
        << engine.error().what;
    EXPECT_NE(engine.error().what.find("resample or crop"), std::string::npos) << engine.error().what;
  }
}

TEST(Engine, OfTheCardRefusesAVolumeBeyondItsTexturesAndAutoTakesTheOther) {
  Volume volume;
  volume.size = {30'000, 2, 2};
  volume.hu.assign(120'000, 0);
  for (const char* name : {"gl", "slices"}) {
    const auto engine = make_engine(name, volume, soft());
    ASSERT_FALSE(engine) << name;
    EXPECT_NE(engine.error().what.find("30000x2x2 is larger than this driver's textures"), std::string::npos)
        << engine.error().what;
    EXPECT_NE(engine.error().what.find("--engine cpu"), std::string::npos);
  }
  const auto engine = make_engine("auto", volume, soft());
  ASSERT_TRUE(engine) << engine.error().what;
  EXPECT_EQ((*engine)->name().substr(0, 4), "cpu,");
  EXPECT_EQ((*engine)->choice().find("engine cpu: OpenGL"), 0U) << (*engine)->choice();
}

TEST(Engine, OfTheProcessorRefusesAVolumeThatItsLoopsCannotCount) {
  Volume volume;
  volume.size = {40'000, 2, 2};
  volume.hu.assign(160'000, 0);
  const auto engine = make_engine("cpu", volume, soft());
  ASSERT_FALSE(engine);
  EXPECT_NE(engine.error().what.find("40000x2x2 is larger than the cpu engine draws"), std::string::npos);
}

}  // namespace
}  // namespace birdseye::host
