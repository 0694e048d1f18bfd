// What the live window, the demo and the replay make of touches and figures: the same.
#include "host/operation/findings.hpp"

#include <gtest/gtest.h>

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "host/guide/guided_calibration.hpp"
#include "host/operation/patient.hpp"
#include "host/operation/replay_setup.hpp"
#include "tests/support/hand_eye_bench.hpp"
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

/// Of a simulated scope over a board, without its lens.
GuidedStations stations_over_a_board() {
  birdseye::testing::HandEyeBench bench({.stations = 20, .corner_px = 0.05, .position_mm = 0.1, .angle_deg = 0.02});
  GuidedStations out;
  out.width_px = bench.input.camera->width_px;
  out.height_px = bench.input.camera->height_px;
  out.input = std::move(bench.input);
  out.input.camera.reset();
  return out;
}

TEST(CalibratedByBoard, HasTheFiguresOfItsLensAndOfHandEye) {
  GuidedStations stations = stations_over_a_board();
  find_lens(stations);
  stations.round_field = RoundField{{320, 240}, 280};
  ASSERT_TRUE(stations.lens.has_value()) << stations.lens_fault;
  const auto solved = calibrate_guided(stations);
  ASSERT_TRUE(solved) << solved.error().what;
  const auto found = calibrated_by_board(*solved, "2026-11-22T09:30:00Z");
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_TRUE(found->by_board);
  EXPECT_EQ(found->made_utc, "2026-11-22T09:30:00Z");
  EXPECT_EQ(found->scope.figures().camera_rms_px, stations.lens->rms_px);
  EXPECT_EQ(found->scope.figures().held_out_px, solved->hand_eye.held_out_px);
  EXPECT_EQ(found->scope.camera().fx_px, stations.lens->camera.fx_px);
  EXPECT_EQ(found->scope.round_field(), stations.round_field);
  // A lens that is given is not judged, and states no figure.
  stations.lens.reset();
  const auto given = calibrated_by_board(*calibrate_guided(stations), "");
  ASSERT_TRUE(given) << given.error().what;
  EXPECT_FALSE(given->scope.figures().camera_rms_px.has_value());
}

TEST(CalibratedByBoard, WhatTheVerdictFailsIsRefusedWithTheReason) {
  GuidedStations stations = stations_over_a_board();
  stations.input.stations.resize(2);
  find_lens(stations);
  EXPECT_FALSE(stations.input.camera.has_value());
  const auto solved = calibrate_guided(stations);
  ASSERT_TRUE(solved) << solved.error().what;
  EXPECT_EQ(solved->verdict.grade, Grade::fail);
  const auto found = calibrated_by_board(*solved, "");
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, Errc::degenerate);
  EXPECT_EQ(found.error().what, "the verdict is fail; no lens was found: " + stations.lens_fault);
}

TEST(RegisterByTouches, TellsWhichFiducialEachTouchWas) {
  const std::vector<std::size_t> order{2, 0, 1};
  std::vector<Eigen::Vector3d> touched;
  for (const std::size_t i : order) touched.emplace_back(kTrackerFromPatient * kFiducials[i]);
  const auto found = register_by_touches(kFiducials, touched, nullptr);
  ASSERT_TRUE(found) << found.error().what;
  ASSERT_EQ(found->registered.fiducials_in_patient_mm.size(), order.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    EXPECT_EQ(found->registered.fiducials_in_patient_mm[i], kFiducials[order[i]]);
  EXPECT_LT(found->registered.fre_mm, 1e-9);
  EXPECT_LT((found->registered.tracker_from_patient.translation() - kTrackerFromPatient.translation()).norm(), 1e-9);
  EXPECT_FALSE(
      register_by_touches(kFiducials, std::vector<Eigen::Vector3d>(touched.begin(), touched.begin() + 2), nullptr));
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

/// Of tissue from -20 mm to 80 mm along x and y, 60 mm along z.
Volume body() {
  Volume out;
  out.size = {51, 51, 41};
  out.spacing_mm = {2, 2, 2};
  out.patient_from_voxel = Eigen::Translation3d(-20, -20, -20) * Eigen::Scaling(2.0);
  out.hu.assign(grid_count(out.size), 40);
  return out;
}

/// The places of the patient, each x and y times a sign, and all lengths times a scale, as the tracker has them.
std::vector<Eigen::Vector3d> touches(const std::vector<Eigen::Vector3d>& places_mm, double scale, double x, double y) {
  std::vector<Eigen::Vector3d> out;
  out.reserve(places_mm.size());
  for (const Eigen::Vector3d& p : places_mm)
    out.emplace_back(kTrackerFromPatient * Eigen::Vector3d(scale * x * p.x(), scale * y * p.y(), scale * p.z()));
  return out;
}

TEST(RegisterByTouches, RefusesWhatCannotBeAndSaysWhatItLooksLike) {
  std::vector<Eigen::Vector3d> five = kFiducials;
  five.emplace_back(60, 60, 35);
  const Volume ct = body();
  const auto told = [&](const std::vector<Eigen::Vector3d>& markers, const std::vector<Eigen::Vector3d>& touched) {
    const auto found = register_by_touches(markers, touched, &ct);
    return found ? "registered " + found->doubt : found.error().what;
  };
  EXPECT_EQ(told(five, touches(five, 1, 1, 1)), "registered ");
  EXPECT_NE(told(five, touches(five, 1, -1, 1)).find("a mirror image of the fiducials"), std::string::npos);
  EXPECT_NE(told(five, touches(five, 1.02, 1, 1)).find("lengths in the CT are 0.9804 times"), std::string::npos);
  // RAS fits as well as LPS: nothing but the CT tells.
  std::vector<Eigen::Vector3d> ras;
  for (const Eigen::Vector3d& p : five) ras.emplace_back(-p.x(), -p.y(), p.z());
  const std::string looks = told(ras, touches(five, 1, 1, 1));
  EXPECT_NE(looks.find("outside of the CT's body: fiducials at (-60, -5, 0), "), std::string::npos) << looks;
  EXPECT_NE(looks.find("looks like RAS"), std::string::npos) << looks;
  EXPECT_TRUE(register_by_touches(ras, touches(five, 1, 1, 1), nullptr));
  std::vector<Eigen::Vector3d> far = five;
  for (Eigen::Vector3d& p : far) p.z() += 500;
  const std::string other = told(far, touches(five, 1, 1, 1));
  EXPECT_NE(other.find("Are they of this CT"), std::string::npos) << other;
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
