#include "host/bench/true_places.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace birdseye::host {
namespace {

using Eigen::Vector3d;

constexpr double kRadius_mm = 30, kFar_mm = 150, kShift_mm = 4;
const Vector3d kCentre_mm(60, 60, 60);
const Vector3d kShift(0, kShift_mm, 0);

/// A ball in air, in voxels of a millimetre.
RegistrationCase ball() {
  constexpr int kVoxels = 121;
  constexpr double kVoxel_mm = 1;
  RegistrationCase c;
  c.ct.size = {kVoxels, kVoxels, kVoxels};
  c.ct.spacing_mm = Vector3d::Constant(kVoxel_mm);
  c.ct.patient_from_voxel.linear() *= kVoxel_mm;
  for (int k = 0; k < kVoxels; ++k) {
    for (int j = 0; j < kVoxels; ++j) {
      for (int i = 0; i < kVoxels; ++i)
        c.ct.hu.push_back((kVoxel_mm * Vector3d(i, j, k) - kCentre_mm).norm() < kRadius_mm ? 100 : -1000);
    }
  }
  return c;
}

/// A view from `away` of the ball's middle, with all of the ball in its picture.
void look(RegistrationCase& c, const Vector3d& away) {
  constexpr int kSize_px = 200;
  VideoView view;
  view.camera = {kSize_px, kSize_px, 200, 200, 99.5, 99.5};
  const Vector3d forward = -away.normalized(), right = forward.unitOrthogonal();
  Eigen::Matrix3d turn;
  turn << right, forward.cross(right), forward;
  view.camera_from_patient = Transform<Patient, Camera>(turn, Vector3d(kCentre_mm + away)).inverse();
  view.grey.assign(std::size_t{kSize_px} * kSize_px, 100);
  view.mask.assign(view.grey.size(), 255);
  c.pictures.push_back({kSize_px, kSize_px, std::vector<std::uint8_t>(3 * view.grey.size(), 100)});
  c.views.push_back(view);
}

/// Everything has moved by kShift.
DisplacementField shifted() {
  DisplacementField field;
  field.size = {2, 2, 2};
  field.displacement_mm.assign(8, Vector3d(-kShift).cast<float>());
  field.patient_from_lattice.linear() *= 200;
  field.patient_from_lattice.translation().setConstant(-40);
  return field;
}

/// How squarely a place of the moved ball faces an eye.
double facing(const Vector3d& now_mm, const Vector3d& away) {
  const Vector3d middle = kCentre_mm + kShift;
  return (kCentre_mm + away - now_mm).normalized().dot((now_mm - middle).normalized());
}

TEST(TruePlaces, TellsWhatViewsSeeOfABallThatHasMoved) {
  const Vector3d above(0, 0, kFar_mm), aside(0.7 * kFar_mm, 0, 0.7 * kFar_mm);
  RegistrationCase c = ball();
  look(c, above);
  look(c, aside);
  const std::vector<Transform<Camera, Patient>> poses{c.views[0].camera_from_patient, c.views[1].camera_from_patient};
  const TransferFunction shown({{0, {0, 0, 0}, 0}, {50, {1, 1, 1}, 1}});
  const auto kinds = true_places(c, shown, shifted(), poses);
  ASSERT_TRUE(kinds) << kinds.error().what;
  ASSERT_EQ(kinds->size(), 6U);
  // What a camera so far from a ball's middle sees of it, but for the rim; a voxel's worth of rim is left open.
  constexpr double kLeastFacing = 0.1, kRim = 0.06;
  std::size_t seen_or_hidden = 0, surface = 0;
  for (const auto& [kind, places] : *kinds) {
    ASSERT_GT(places.size(), 100U) << kind;
    int odd = 0;
    if (kind == "surface") surface = places.size();
    if (kind == "seen" || kind == "hidden") seen_or_hidden += places.size();
    for (const TruePlace& place : places) {
      EXPECT_NEAR((place.now_mm - place.rest_mm - kShift).norm(), 0, 1e-3);
      const double depth_mm = kRadius_mm - (place.rest_mm - kCentre_mm).norm();
      if (kind == "inside") {
        EXPECT_GT(depth_mm, 5);
        continue;
      }
      EXPECT_NEAR(depth_mm, 0, 0.6);
      const double most = std::max(facing(place.now_mm, above), facing(place.now_mm, aside));
      const double least = std::min(facing(place.now_mm, above), facing(place.now_mm, aside));
      const bool as_it_faces = kind == "hidden"        ? most < kLeastFacing + kRim
                               : kind == "seen_by_two" ? least > kLeastFacing - kRim
                               : kind == "surface"     ? true
                                                       : most > kLeastFacing - kRim;
      odd += as_it_faces ? 0 : 1;
    }
    // Voxels have corners, where a ball's normal is off.
    EXPECT_LE(odd, static_cast<int>(places.size() / 100)) << kind;
    const auto before = error_of(places, nullptr);
    EXPECT_NEAR(before.mean_mm, kShift_mm, 1e-3);
    EXPECT_NEAR(before.rms_mm, kShift_mm, 1e-3);
    const DisplacementField found = shifted();
    EXPECT_NEAR(error_of(places, &found).mean_mm, 0, 1e-3);
  }
  EXPECT_EQ(seen_or_hidden, surface);
}

TEST(TruePlaces, ErrorsAreMeansAndRootMeanSquares) {
  const std::vector<TruePlace> places{{{0, 0, 0}, {3, 0, 0}}, {{0, 0, 0}, {0, 0, -1}}};
  const auto error = error_of(places, nullptr);
  EXPECT_NEAR(error.mean_mm, 2, 1e-12);
  EXPECT_NEAR(error.rms_mm, std::sqrt(5.0), 1e-12);
}

}  // namespace
}  // namespace birdseye::host
