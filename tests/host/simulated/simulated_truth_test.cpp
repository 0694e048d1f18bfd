// Whatever befalls the operation: the truth that is written down says where in the picture the target's place is seen.
#include "host/simulated/simulated_truth.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <string>

#include "hw-sim/world/truth_files.hpp"
#include "tests/support/ball_world.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using hw_sim::FaultKind;

constexpr double kRateHz = 5, kBefallsS = 20;

hw_sim::Fault fault(FaultKind kind, std::map<std::string, double, std::less<>> values) {
  hw_sim::Fault out;
  out.kind = kind;
  out.at_s = kBefallsS;
  out.values = std::move(values);
  return out;
}

/// The middle of what is bright in a picture: of a small ball that the lamp at the lens lights, its centre.
Eigen::Vector2d bright_middle_px(const std::vector<std::uint8_t>& rgb, const CameraModel& lens) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double weight = 0;
  for (int y = 0; y < lens.height_px; ++y) {
    for (int x = 0; x < lens.width_px; ++x) {
      const double light = rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(lens.width_px) +
                                    static_cast<std::size_t>(x))];
      sum += light * Eigen::Vector2d(x, y);
      weight += light;
    }
  }
  EXPECT_GT(weight, 0) << "the ball is not in the picture";
  return sum / weight;
}

struct Befalls {
  const char* name;
  std::vector<hw_sim::Fault> faults;
  bool seen;  ///< the target's place in the picture changes
};

class TruthUnder : public ::testing::TestWithParam<Befalls> {};

TEST_P(TruthUnder, TheTargetIsSeenWhereTheTruthHasIt) {
  const testing::BallPatient patient;
  const CameraModel lens = hw_sim::laparoscope_lens(768, 576);
  const auto world = patient.world(GetParam().faults, hw_sim::ReferenceOn::patient);
  const auto quiet = patient.world({});
  ASSERT_TRUE(world && quiet) << world.error().what;
  const testing::Scratch scratch;
  const Eigen::Vector3d& tumour_mm = patient.truth.tumour_centre_mm;
  ASSERT_TRUE(hw_sim::write_truth(scratch / "cart", *world, {lens, kRateHz, {.amplitude_mm = 0}, tumour_mm}));
  const auto truth = read_simulated_truth(scratch / "cart" / "truth");
  ASSERT_TRUE(truth) << truth.error().what;
  ASSERT_TRUE(hw_sim::write_truth(scratch / "quiet", *quiet, {lens, kRateHz, {.amplitude_mm = 0}, tumour_mm}));
  const auto without = read_simulated_truth(scratch / "quiet" / "truth");
  ASSERT_TRUE(without);

  // In the place of the liver, a small ball at the target, before black.
  constexpr double kBallMm = 2;
  const Eigen::Vector3d reach_mm = Eigen::Vector3d::Constant(3);
  const hw_sim::Mesh ball =
      hw_sim::closed_surface([&](const Eigen::Vector3d& p) { return (p - tumour_mm).norm() - kBallMm; },
                             tumour_mm - reach_mm, tumour_mm + reach_mm, 0.25);
  const auto scope = hw_sim::Laparoscope::create({.lens = lens, .noise = 0});
  ASSERT_TRUE(scope);
  (*scope)->set_cavity({.organ = ball, .texture = 0, .wet = 0});
  double most_changed_px = 0;
  for (const double t : {kBefallsS - 0.4, kBefallsS + 0.4, kBefallsS + 1.2, kBefallsS + 2.8}) {
    const auto sequence = static_cast<std::uint64_t>(std::llround(t * kRateHz));
    const double world_s = static_cast<double>(sequence) / kRateHz;
    ASSERT_LT(world_s, world->ends_s());
    (*scope)->zoom(world->zoom(world_s));
    (*scope)->change_organ(world->organ(world_s));
    const auto seen_px = bright_middle_px(
        (*scope)->look_into_cavity(world->tracker_from_camera(world_s).inverse() * world->tracker_from_patient(world_s),
                                   sequence),
        lens);
    const auto pixel_of = [&](const SimulatedTruth& of) {
      const SimulatedTruth::Frame& frame = of.frames.at(sequence);
      return *project(frame.camera, frame.camera_from_patient * frame.tumour_centre_in_patient_mm);
    };
    EXPECT_LT((seen_px - pixel_of(*truth)).norm(), 0.3) << GetParam().name << " at " << world_s << " s";
    const double changed_px = (pixel_of(*truth) - pixel_of(*without)).norm();
    if (t < kBefallsS) {
      EXPECT_LT(changed_px, 1e-6);
    }
    most_changed_px = std::max(most_changed_px, changed_px);
    // An overlay with the truth's own pose, lens and target is right.
    const SimulatedTruth::Frame& frame = truth->frames.at(sequence);
    const auto error =
        overlay_error(*truth, sequence, frame.camera, frame.camera_from_patient, frame.tumour_centre_in_patient_mm);
    ASSERT_TRUE(error);
    EXPECT_EQ(error->overlay_px, 0);
    EXPECT_EQ(error->target_mm, 0);
  }
  if (GetParam().seen) {
    EXPECT_GT(most_changed_px, 10) << GetParam().name;
  } else {
    EXPECT_LT(most_changed_px, 1e-6) << GetParam().name;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Each, TruthUnder,
    ::testing::Values(
        Befalls{"transmitter_bumped",
                {fault(FaultKind::transmitter_bumped, {{"mm", 25}, {"deg", 5}, {"over_s", 0.2}})},
                false},
        Befalls{"bed_tilted", {fault(FaultKind::bed_tilted, {{"deg", 8}, {"over_s", 1}})}, false},
        Befalls{"patient_moved", {fault(FaultKind::patient_moved, {{"mm", 10}, {"deg", 3}, {"over_s", 1}})}, false},
        Befalls{
            "reference_moved", {fault(FaultKind::reference_moved, {{"mm", 9}, {"deg", 3}, {"over_s", 0.1}})}, false},
        Befalls{"breathing", {fault(FaultKind::breathing, {{"mm", 12}, {"period_s", 4}})}, true},
        Befalls{"resected",
                {fault(FaultKind::resected, {{"width_mm", 40}, {"depth_mm", 20}, {"aside_mm", 40}, {"over_s", 0}})},
                false},
        Befalls{"lens_zoomed", {fault(FaultKind::lens_zoomed, {{"factor", 1.4}, {"over_s", 0.5}})}, true},
        Befalls{"scope_turned", {fault(FaultKind::scope_turned, {{"deg", 30}, {"over_s", 0.5}})}, true},
        Befalls{"all of them",
                {fault(FaultKind::transmitter_bumped, {{"mm", 25}, {"deg", 5}, {"over_s", 0.2}}),
                 fault(FaultKind::bed_tilted, {{"deg", 5}, {"over_s", 1}}),
                 fault(FaultKind::breathing, {{"mm", 8}, {"period_s", 3}}),
                 fault(FaultKind::lens_zoomed, {{"factor", 0.8}, {"over_s", 0.5}}),
                 fault(FaultKind::scope_turned, {{"deg", -40}, {"over_s", 2}})},
                true}),
    [](const ::testing::TestParamInfo<Befalls>& one) {
      std::string name(one.param.name);
      for (char& c : name) c = c == ' ' ? '_' : c;
      return name;
    });

TEST(SimulatedTruth, ATruthThatLacksFramesIsRefused) {
  const testing::BallPatient patient;
  const auto world = patient.world({});
  ASSERT_TRUE(world);
  const testing::Scratch scratch;
  ASSERT_TRUE(hw_sim::write_truth(scratch / "cart", *world,
                                  {hw_sim::laparoscope_lens(768, 576), kRateHz, {.amplitude_mm = 0}, {0, 0, 0}}));
  std::filesystem::remove(scratch / "cart" / "truth" / "scene.csv");
  const auto truth = read_simulated_truth(scratch / "cart" / "truth");
  ASSERT_FALSE(truth);
  EXPECT_NE(truth.error().what.find("scene.csv"), std::string::npos) << truth.error().what;
}

}  // namespace
}  // namespace birdseye::host
