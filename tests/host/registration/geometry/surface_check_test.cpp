#include "host/registration/geometry/surface_check.hpp"

#include <gtest/gtest.h>

#include <random>

#include "host/registration/geometry/lattice_field.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/simulated_case.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::Scratch;
using birdseye::testing::simulated_case;

constexpr int kWidth_px = 768, kHeight_px = 576;
constexpr CheckErrors kErrors{0.5, 0.3};

/// An organ whose outline shows all about the picture, off by outwards_mm of a place, with the outline's own noise.
template <typename Outwards>
CheckedPlaces outlined(int places, unsigned seed, const Outwards& outwards_mm) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.3);
  std::uniform_real_distribution<double> x(0, kWidth_px), y(0, kHeight_px);
  CheckedPlaces out{kWidth_px, kHeight_px, {}, {}};
  for (int i = 0; i < places; ++i) {
    const Eigen::Vector2d at_px(x(random), y(random));
    out.outline.push_back({at_px, outwards_mm(at_px) + noise(random)});
  }
  return out;
}

TextureShift shifted(int part, int places, const Eigen::Vector2d& shift_mm) {
  TextureShift out;
  out.part = part;
  out.places = places;
  out.shift_mm = shift_mm;
  out.per_surface_mm = 0.5;
  return out;
}

TEST(SurfaceCheck, OfErrorsThatWereExpectedFewerThanOneInAHundredIsAnAlarm) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  constexpr int kChecks = 2000;
  int alarms = 0;
  for (unsigned n = 0; n < kChecks; ++n) {
    // Each part has its own error of the surface, and all have that of the pose.
    std::array<double, kWholePicture> surface_mm{};
    for (double& one : surface_mm) one = kErrors.surface_mm * normal(random);
    const Eigen::Vector2d pose_mm = kErrors.pose_mm * Eigen::Vector2d(normal(random), normal(random));
    CheckedPlaces places = outlined(150, n, [&](const Eigen::Vector2d& at_px) {
      return surface_mm[static_cast<std::size_t>(part_of(at_px.x(), at_px.y(), kWidth_px, kHeight_px))] + pose_mm.x();
    });
    for (int part = 0; part < kWholePicture; ++part) {
      const double parallax_mm = 0.5 * surface_mm[static_cast<std::size_t>(part)];
      places.texture.push_back(shifted(part, 30, pose_mm + parallax_mm * Eigen::Vector2d::UnitX()));
    }
    if (judge(places, kErrors).verdict == SurfaceVerdict::moved) ++alarms;
  }
  EXPECT_LE(alarms, kChecks / 100);
}

TEST(SurfaceCheck, SeesAllOfItMoveAndAPushInOnePart) {
  const SurfaceFinding still = judge(outlined(200, 1, [](const auto&) { return 0.0; }), kErrors);
  EXPECT_EQ(still.verdict, SurfaceVerdict::holds) << still.words;
  ASSERT_TRUE(still.figure_mm.has_value());
  EXPECT_LT(*still.figure_mm, 0.6);
  const SurfaceFinding all = judge(outlined(200, 1, [](const auto&) { return 4.0; }), kErrors);
  EXPECT_EQ(all.verdict, SurfaceVerdict::moved);
  EXPECT_NEAR(*all.figure_mm, 4, 0.3);
  EXPECT_GT(*all.figure_mm, *all.bound_mm);
  const SurfaceFinding pushed = judge(
      outlined(200, 1, [](const Eigen::Vector2d& at) { return at.x() > 512 && at.y() > 384 ? -4.0 : 0.0; }), kErrors);
  EXPECT_EQ(pushed.verdict, SurfaceVerdict::moved);
  EXPECT_NE(pushed.words.find("lower right"), std::string::npos) << pushed.words;
  // Half of a part outwards and half inwards has no median.
  const SurfaceFinding bent =
      judge(outlined(200, 1, [](const Eigen::Vector2d& at) { return static_cast<int>(at.x()) % 2 == 0 ? -4.0 : 4.0; }),
            kErrors);
  EXPECT_EQ(bent.verdict, SurfaceVerdict::moved);
}

TEST(SurfaceCheck, SeesTextureThatSlid) {
  CheckedPlaces places{kWidth_px, kHeight_px, {}, {}};
  places.texture.push_back(shifted(3, 40, {0.3, 0}));
  places.texture.push_back(shifted(kWholePicture, 90, {0.2, 0.1}));
  EXPECT_EQ(judge(places, kErrors).verdict, SurfaceVerdict::holds);
  places.texture[0].shift_mm = Eigen::Vector2d(0, 3.5);
  const SurfaceFinding slid = judge(places, kErrors);
  EXPECT_EQ(slid.verdict, SurfaceVerdict::moved);
  EXPECT_NE(slid.words.find("at the left"), std::string::npos) << slid.words;
  // What is not known so well is not said to have moved, nor to hold.
  EXPECT_NE(judge(places, {3, 0.3}).verdict, SurfaceVerdict::moved);
  const SurfaceFinding mute = judge(places, {0.5, 2.5});
  EXPECT_EQ(mute.verdict, SurfaceVerdict::cannot_tell);
  EXPECT_FALSE(mute.figure_mm.has_value());
  EXPECT_NE(mute.words.find("would not show"), std::string::npos) << mute.words;
}

TEST(SurfaceCheck, CannotTellByTooFewPlaces) {
  for (const CheckedPlaces& places :
       {CheckedPlaces{kWidth_px, kHeight_px, {}, {}}, outlined(12, 1, [](const auto&) { return 0.0; })}) {
    const SurfaceFinding finding = judge(places, kErrors);
    EXPECT_EQ(finding.verdict, SurfaceVerdict::cannot_tell);
    EXPECT_FALSE(finding.figure_mm.has_value());
    EXPECT_NE(finding.words.find("too little"), std::string::npos) << finding.words;
  }
  // An outline that holds is no answer where the texture is gone.
  CheckedPlaces gone = outlined(200, 1, [](const auto&) { return 0.0; });
  gone.texture.push_back(shifted(kWholePicture, 80, {0, 0}));
  gone.texture.back().shift_mm.reset();
  const SurfaceFinding finding = judge(gone, kErrors);
  EXPECT_EQ(finding.verdict, SurfaceVerdict::cannot_tell);
  EXPECT_NE(finding.words.find("found again"), std::string::npos) << finding.words;
}

TEST(SurfaceCheck, TellsASimulatedLiverThatMovedFromOneThatDidNot) {
  const Scratch scratch;
  const RegistrationCase then = simulated_case(scratch / "then", 6), later = simulated_case(scratch / "later", 12);
  const auto truth = read_field(scratch / "then/truth/field.mha");
  ASSERT_TRUE(truth);
  const auto transfer = load_transfer_function(then.transfer);
  ASSERT_TRUE(transfer);
  const auto rest =
      signed_distance_of(then.ct, tissue_voxels(then.ct, &*then.labels, then.label_values, *transfer), 2, 24);
  ASSERT_TRUE(rest);
  LatticeField field(*rest);
  for (std::size_t n = 0; n < field.size(); ++n) field.set(n, truth->displacement(field.place_mm(n)));
  std::vector<PinholeView> kept;
  for (std::size_t n = 1; n < then.views.size(); ++n) {
    auto view = view_to_check(then.views[n].camera, then.views[n].camera_from_patient, then.pictures[n].view());
    ASSERT_TRUE(view);
    kept.push_back(*std::move(view));
  }
  const SurfaceCheck check(seen_distance(*rest, field), kept);
  const auto seen = [&](const RegistrationCase& by) {
    return check.check(*view_to_check(by.views[0].camera, by.views[0].camera_from_patient, by.pictures[0].view()),
                       kErrors);
  };
  const SurfaceFinding same = seen(then), moved = seen(later);
  EXPECT_EQ(same.verdict, SurfaceVerdict::holds) << same.words;
  EXPECT_LT(same.figure_mm.value_or(9), 1) << same.words;
  EXPECT_EQ(moved.verdict, SurfaceVerdict::moved) << moved.words;
  // Of the box's far side nothing is seen.
  const Transform<Camera, Patient> away(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, 0, -5000));
  EXPECT_EQ(check.check(*view_to_check(then.views[0].camera, away, then.pictures[0].view()), kErrors).verdict,
            SurfaceVerdict::cannot_tell);
}

TEST(SurfaceCheck, RefusesAPictureOfAnotherSize) {
  const std::vector<std::uint8_t> pixels(std::size_t{3} * 20 * 10);
  const auto refused = view_to_check({40, 30, 40, 40, 20, 15}, {}, {pixels, 20, 10});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("20x10"), std::string::npos);
}

}  // namespace
}  // namespace birdseye::host
