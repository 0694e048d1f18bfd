// What the live window, the demo and the replay make of touches and figures: the same.
#include "host/operation/findings.hpp"

#include <gtest/gtest.h>

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "host/operation/patient.hpp"
#include "host/operation/replay_setup.hpp"
#include "tests/support/live_operation.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::kFiducials;
using birdseye::testing::kTrackerFromPatient;

ScopeSetup scope(std::optional<double> camera_rms_px, double held_out_px) {
  calibration::HandEyeResult found;
  found.held_out_px = held_out_px;
  found.held_out_mm = 0.5;
  return ScopeSetup::of_hand_eye({768, 576, 500, 500, 384, 288}, camera_rms_px, found);
}

Volume ct() {
  Volume out;
  out.size = {31, 41, 51};
  return out;
}

TEST(RegisterByTouches, TellsWhichFiducialEachTouchWas) {
  const std::vector<std::size_t> order{2, 0, 1};
  std::vector<Eigen::Vector3d> touched;
  for (const std::size_t i : order) touched.emplace_back(kTrackerFromPatient * kFiducials[i]);
  const auto found = register_by_touches(kFiducials, touched);
  ASSERT_TRUE(found) << found.error().what;
  ASSERT_EQ(found->registered.fiducials_in_patient_mm.size(), order.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    EXPECT_EQ(found->registered.fiducials_in_patient_mm[i], kFiducials[order[i]]);
  EXPECT_LT(found->registered.fre_mm, 1e-9);
  EXPECT_LT((found->registered.tracker_from_patient.translation() - kTrackerFromPatient.translation()).norm(), 1e-9);
  EXPECT_FALSE(register_by_touches(kFiducials, std::vector<Eigen::Vector3d>(touched.begin(), touched.begin() + 2)));
}

TEST(ReplayTrust, OfTouchesIsWhatALiveOperationWouldJudgeBy) {
  const RegisteredPatient registered{kTrackerFromPatient, 0.4, kFiducials};
  const ReplaySetup setup{scope(0.3, 2), kTrackerFromPatient, registered, {}, 0.4, 4};
  const ReplayTrust trust = trust_of(setup, ct());
  EXPECT_TRUE(trust.vouched_for.empty());
  const TrustFigures live = trust_figures(setup.scope.figures(), registered, Eigen::Vector3d(15, 20, 25));
  EXPECT_EQ(trust.figures.target_mm, live.target_mm);
  EXPECT_GT(*trust.figures.target_mm, 0);
  EXPECT_EQ(trust.figures.scope.held_out_px, 2);
  EXPECT_EQ(trust.figures.fre_mm, 0.4);
}

TEST(ReplayTrust, OfFilesNamesEachFigureThatNothingSays) {
  ReplaySetup setup{scope(std::nullopt, 0), kTrackerFromPatient, {}, {}, std::nullopt, 0, true};
  EXPECT_EQ(trust_of(setup, ct()).vouched_for,
            (std::vector<std::string>{"camera_rms_px", "held_out_px", "fre_mm", "target_mm"}));
  setup.scope = scope(0.3, 2);
  setup.fre_mm = 9;
  const ReplayTrust trust = trust_of(setup, ct());
  EXPECT_EQ(trust.vouched_for, std::vector<std::string>{"target_mm"});
  EXPECT_EQ(trust.figures.fre_mm, 9) << "what is stated stays";
}

TEST(ReplayTrust, NobodyAnswersForWhatARecordDoesNotState) {
  const ReplaySetup setup{scope(std::nullopt, 0), kTrackerFromPatient, {}, {}, 0.4, 0, false};
  const ReplayTrust trust = trust_of(setup, ct());
  EXPECT_EQ(trust.vouched_for, std::vector<std::string>{"target_mm"});
  EXPECT_FALSE(trust.figures.scope.camera_rms_px);
}

TEST(Target, IsTheFirstLandmarkElseTheMiddleOfTheCt) {
  PatientPlan plan;
  plan.ct = ct();
  EXPECT_EQ(target_in_patient_mm(plan), Eigen::Vector3d(15, 20, 25));
  plan.landmarks = {{"tumour", {1, 2, 3}}, {"vessel", {4, 5, 6}}};
  EXPECT_EQ(target_in_patient_mm(plan), Eigen::Vector3d(1, 2, 3));
}

}  // namespace
}  // namespace birdseye::host
