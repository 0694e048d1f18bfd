#include "host/case/registration_verdict.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace birdseye::host {
namespace {

/// Of a target that a thousand places make known.
ViewRegistration well_found() {
  ViewRegistration out;
  out.stereo_points = 1000;
  out.evidence_of_motion_nats = 40;
  out.expected.emplace();
  out.expected->seen = ExpectedError{0.5, 0.8, 0.1};
  out.expected->seen_moved_mm = 6;
  out.expected->targets.push_back({1, 1.6, 0.2});
  return out;
}

RegistrationCase with_target() {
  RegistrationCase out;
  out.views.resize(3);
  out.views[1].name = "view1.png";
  out.target_mm = Eigen::Vector3d::Zero();
  return out;
}

bool says(const Verdict& verdict, const std::string& words) {
  return verdict.reasons.front().find(words) != std::string::npos;
}

TEST(RegistrationVerdict, PassesWhereTheTargetIsKnown) {
  const Verdict verdict = verdict_of(with_target(), well_found());
  EXPECT_EQ(verdict.grade, Grade::pass);
  EXPECT_FALSE(says(verdict, "nothing moved")) << verdict.reasons.front();
}

TEST(RegistrationVerdict, OfACaseThatNamesNoTargetIsByTheInsideAndNotByALandmark) {
  RegistrationCase none_named = with_target();
  none_named.target_mm.reset();
  ViewRegistration found = well_found();
  found.expected->inside = {4, 6.5, 0.7};  // its targets are the truth's landmarks then, which are well known
  EXPECT_EQ(verdict_of(none_named, found).grade, Grade::marginal);
  EXPECT_TRUE(says(verdict_of(none_named, found), "the organ's inside may be 6.5 mm off"));
  found.expected->inside = {0.5, 1, 0.2};
  EXPECT_EQ(verdict_of(none_named, found).grade, Grade::pass);
  found.expected->inside.reset();
  EXPECT_EQ(verdict_of(none_named, found).grade, Grade::marginal);
}

TEST(RegistrationVerdict, FailsWhatFoldsHoweverWellTheTargetIsKnown) {
  ViewRegistration found = well_found();
  found.folded = found.worse_than_start = true;
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::fail);
  EXPECT_TRUE(says(verdict_of(with_target(), found), "folds"));
}

TEST(RegistrationVerdict, SaysThatNothingMovedWhereEvidenceGainsNothingByAMotion) {
  ViewRegistration found = well_found();
  found.evidence_of_motion_nats = 2.9;
  found.expected->seen_moved_mm = 3;
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::pass);
  EXPECT_TRUE(says(verdict_of(with_target(), found), "nothing moved beyond 3.8 mm"));
  found.expected->seen_moved_mm = 6;
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::marginal);
  EXPECT_TRUE(says(verdict_of(with_target(), found), "nothing moved beyond 6.8 mm"));
}

TEST(RegistrationVerdict, SaysThatNothingMovedWhereTheMotionIsUnderWhatIsUnknownOfIt) {
  ViewRegistration found = well_found();
  found.expected->seen_moved_mm = 0.9;
  const Verdict verdict = verdict_of(with_target(), found);
  EXPECT_EQ(verdict.grade, Grade::pass);
  EXPECT_TRUE(says(verdict, "nothing moved beyond 1.7 mm")) << verdict.reasons.front();
}

TEST(RegistrationVerdict, NamesTheOpenSidesOfATargetThatIsNotKnown) {
  ViewRegistration found = well_found();
  found.expected->targets.front() = {4, 6.5, 0.7};
  found.expected->open = {{"back", 0.9, 4.1}, {"left", 0.3, 2.2}};
  const Verdict verdict = verdict_of(with_target(), found);
  EXPECT_EQ(verdict.grade, Grade::marginal);
  EXPECT_TRUE(
      says(verdict, "add views of the organ's back (90 % of it known mostly by the prior, 4.1 mm rms) and left"))
      << verdict.reasons.front();
  found.expected->targets.front().radius95_mm = 16;
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::fail);
}

TEST(RegistrationVerdict, NamesAViewThatDoesNotBearOutTheOthers) {
  ViewRegistration found = well_found();
  found.held_out = HeldOutView{1, 40, 0.59, 0.2};
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::pass);
  found.held_out->off_mm = 0.61;
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::marginal);
  EXPECT_TRUE(says(verdict_of(with_target(), found), "view1.png does not bear out"));
  // So little may be the lens's.
  found.held_out = HeldOutView{1, 40, 0.49, 0.1};
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::pass);
}

TEST(RegistrationVerdict, FailsALensThatTheMatchesBetweenTheViewsBelie) {
  ViewRegistration found = well_found();
  found.agreement.emplace();
  found.agreement->focal = {0.049, 0.003};
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::fail);
  EXPECT_TRUE(says(verdict_of(with_target(), found), "4.9 % shorter"));
  EXPECT_TRUE(says(verdict_of(with_target(), found), "calibrate the camera again"));
  found.outline_off_mm = {0.2, 2.5, 0.2};  // by the lens as well
  EXPECT_TRUE(says(verdict_of(with_target(), found), "calibrate the camera again"));
  found.outline_off_mm.clear();
  found.agreement->focal.share = -0.049;
  EXPECT_TRUE(says(verdict_of(with_target(), found), "4.9 % longer"));
  // Within what a calibration states, what the matches leave open, or what patches of a bent surface err by.
  found.agreement->stated_focal_sigma = 0.01;
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::pass);
  found.agreement->stated_focal_sigma = 0;
  found.agreement->focal.sigma = 0.01;
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::pass);
  found.agreement->focal = {0.019, 0.001};
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::pass);
}

TEST(RegistrationVerdict, FailsAViewThatTheOthersPutElsewhere) {
  ViewRegistration found = well_found();
  found.agreement.emplace();
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::pass);
  found.agreement->odd = OddView{1, {14.6, 0.01}, {0.5, 0.002}};
  const Verdict verdict = verdict_of(with_target(), found);
  EXPECT_EQ(verdict.grade, Grade::fail);
  EXPECT_TRUE(says(verdict, "view1.png does not agree with the other views, which put it 14.6 mm"))
      << verdict.reasons.front();
  EXPECT_TRUE(says(verdict, "leave this view out"));
}

TEST(RegistrationVerdict, NamesAViewWhoseOutlineIsFurtherOffThanTheOthersAre) {
  ViewRegistration found = well_found();
  found.outline_off_mm = {0.2, 0.9, std::nullopt};
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::marginal);
  EXPECT_TRUE(says(verdict_of(with_target(), found), "view1.png does not agree with the other views"));
  found.outline_off_mm = {0.24, 0.9, 0.24};  // all views are off by as much, as with blood on the organ
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::pass);
  found.outline_off_mm = {0.1, 0.79, 0.1};
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::pass);
  found.outline_off_mm = {std::nullopt, 0.9, std::nullopt};
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::pass);
}

TEST(RegistrationVerdict, SaysWhereTheLensIsTakenForExact) {
  ViewRegistration found = well_found();
  EXPECT_FALSE(says(verdict_of(with_target(), found), "lens"));
  found.lens_error_counted = false;
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::pass);
  EXPECT_TRUE(says(verdict_of(with_target(), found), "if the lens is as its camera file says"));
  EXPECT_TRUE(says(verdict_of(with_target(), found), "so few views do not tell"));
  found.agreement.emplace();
  found.agreement->focal = {0.003, 0.006};
  EXPECT_TRUE(says(verdict_of(with_target(), found), "the views bear its focal lengths out to 3 %"));
  RegistrationCase of_two = with_target();
  of_two.views.resize(2);
  EXPECT_TRUE(says(verdict_of(of_two, found), "so few views do not tell"));
}

TEST(RegistrationVerdict, PassesNoTargetThatThePriorAloneTellsOf) {
  ViewRegistration found = well_found();
  found.expected->targets.front().left_of_prior = 0.9;
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::marginal);
  EXPECT_TRUE(says(verdict_of(with_target(), found), "nothing that is seen tells of the target"));
  found.expected->targets.front().left_of_prior = 0.89;
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::pass);
}

TEST(RegistrationVerdict, FailsATargetWhoseErrorIsNoNumber) {
  ViewRegistration found = well_found();
  for (const double odd : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    found.expected->targets.front().radius95_mm = odd;
    EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::fail) << odd;
  }
}

TEST(RegistrationVerdict, FailsPosesThatErrByAsMuchAsIsLookedFor) {
  ViewRegistration found = well_found();
  found.adjusted.emplace();
  found.adjusted->noise = {3.9, 0.01};
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::pass);
  found.adjusted->noise.eye_mm = 4;
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::fail);
  EXPECT_TRUE(says(verdict_of(with_target(), found), "put the eye 4 mm or more off"));
}

TEST(RegistrationVerdict, LittleStereoPassesOnlyWhereTouchesMakeTheTargetKnown) {
  ViewRegistration found = well_found();
  found.stereo_points = 99;
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::marginal);
  found.touches.assign(4, {0.5, 0.9});
  found.matched.assign(2, {0.5, 0.9});
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::pass);
  found.touches.front().weight = 0.1;
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::marginal);
  found.touches.push_back({0.5, 0.9});
  found.expected->targets.front().left_of_prior = 0.5;
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::marginal);
  found.stereo_points = 100;
  EXPECT_EQ(verdict_of(with_target(), found).grade, Grade::pass);
}

/// By similarity, of two views that look from far apart.
struct BySimilarity {
  RegistrationCase given;
  ViewRegistration found;

  BySimilarity() {
    given.similarity = "mi";
    given.ct.size = {2, 2, 2};
    given.views.resize(2);
    given.views[0].camera_from_patient = {Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, 0, 100)};
    given.views[1].camera_from_patient = {Eigen::Matrix3d::Identity(), Eigen::Vector3d(80, 0, 100)};
    found.per_view_before = {0.3, 0.4};
    found.per_view_after = {0.3, 0.4};
    found.similarity_before = found.similarity_after = 0.35;
    found.held_out_gain = HeldOutGain{0.001, 0.002};
    found.uncertainty_mm = 2.4;
  }
};

TEST(RegistrationVerdict, BySimilarityPassesWhereNothingMovedBeyondWhatMayBeOff) {
  BySimilarity by;
  const Verdict verdict = verdict_of(by.given, by.found);
  EXPECT_EQ(verdict.grade, Grade::pass);
  EXPECT_TRUE(says(verdict, "nothing moved beyond 3.9 mm")) << verdict.reasons.front();
  by.found.uncertainty_mm = 3.2;
  EXPECT_EQ(verdict_of(by.given, by.found).grade, Grade::marginal);
  EXPECT_TRUE(says(verdict_of(by.given, by.found), "nothing moved beyond 5.2 mm"));
  by.found.uncertainty_mm.reset();
  EXPECT_EQ(verdict_of(by.given, by.found).grade, Grade::marginal);
}

TEST(RegistrationVerdict, BySimilaritySaysNothingOfNoMotionWhereThereIsOne) {
  BySimilarity by;
  by.found.similarity_after = 0.45;
  by.found.held_out_gain = HeldOutGain{0.08, 0.03};
  EXPECT_EQ(verdict_of(by.given, by.found).grade, Grade::pass);
  EXPECT_FALSE(says(verdict_of(by.given, by.found), "nothing moved"));
  by.found.held_out_gain = HeldOutGain{0.08, 0.05};
  EXPECT_EQ(verdict_of(by.given, by.found).grade, Grade::marginal);
  EXPECT_TRUE(says(verdict_of(by.given, by.found), "the views do not agree that anything moved"));
}

}  // namespace
}  // namespace birdseye::host
