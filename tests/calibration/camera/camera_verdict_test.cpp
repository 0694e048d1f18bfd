// What a calibration is told for each thing that can be wrong with it, and views that determine none.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "calibration/camera/camera_calibration.hpp"
#include "tests/support/board_views.hpp"

namespace birdseye::calibration {
namespace {

using birdseye::testing::BoardScene;
using birdseye::testing::hd_lens;
using Views = std::vector<PatternView>;

bool says(const Verdict& verdict, const std::string& words) {
  return std::any_of(verdict.reasons.begin(), verdict.reasons.end(),
                     [&](const std::string& r) { return r.find(words) != std::string::npos; });
}

std::string all_of(const Verdict& verdict) {
  std::string out;
  for (const std::string& reason : verdict.reasons) out += reason + "\n";
  return out;
}

/// A calibration to which nothing is to be said.
CameraCalibration good() {
  const auto result = calibrate_camera(BoardScene().views(hd_lens(), 14, 1), 1920, 1080, {.model = LensModel::radial1});
  EXPECT_TRUE(result);
  return *result;
}

TEST(CameraVerdict, NamesEachThingThatIsWrong) {
  const CameraCalibration sound = good();
  ASSERT_EQ(judge_camera(sound).grade, Grade::pass) << all_of(judge_camera(sound));
  EXPECT_TRUE(judge_camera(sound).next_steps.empty());
  const struct {
    void (*spoil)(CameraCalibration&);
    Grade grade;
    const char* words;
  } cases[] = {
      {[](CameraCalibration& c) { c.held_out_px = 1.2; }, Grade::marginal, "held-out error 1.20 px, more than 1.00"},
      {[](CameraCalibration& c) { c.held_out_px = 6; }, Grade::fail, "held-out error"},
      {[](CameraCalibration& c) { c.held_out_px = NAN; }, Grade::fail, "held-out error"},
      {[](CameraCalibration& c) {
         c.camera.width_px = 480;
         c.held_out_px = 0.4;
       },
       Grade::marginal, "more than 0.25"},
      {[](CameraCalibration& c) { c.outliers = c.points.size() / 10; }, Grade::marginal, "outliers"},
      {[](CameraCalibration& c) { c.outliers = c.points.size() / 2; }, Grade::fail, "outliers"},
      {[](CameraCalibration& c) { c.folds = true; }, Grade::fail, "folds inside the picture"},
      {[](CameraCalibration& c) { c.undetermined = "fx_px"; }, Grade::fail, "leave fx_px open"},
      {[](CameraCalibration& c) { c.covariance(1, 1) = 15 * 15; }, Grade::marginal, "focal length known to 1.04 %"},
      {[](CameraCalibration& c) { c.covariance(0, 0) = 50 * 50; }, Grade::fail, "focal length known to"},
      {[](CameraCalibration& c) { c.refuted_by = LensModel::radial3_tangential2; }, Grade::marginal,
       "refute the lens model"},
      {[](CameraCalibration& c) { c.covariance(2, 2) = 12 * 12; }, Grade::marginal, "picture centre known to"},
      {[](CameraCalibration& c) { c.camera.fx_px *= 1.16; }, Grade::marginal, "wrong aspect"},
      {[](CameraCalibration& c) { c.camera.fx_px /= 1.33; }, Grade::fail, "wrong aspect"},
      {[](CameraCalibration& c) { c.views.resize(7); }, Grade::marginal, "views used: 7, less than 10"},
      {[](CameraCalibration& c) { c.views.resize(4); }, Grade::fail, "views used: 4, less than 5"},
      {[](CameraCalibration& c) {
         c.rejected.assign(30, {0, "a.png", "blurred"});
       },
       Grade::marginal, "views rejected"},
      {[](CameraCalibration& c) { c.coverage = 0.3; }, Grade::marginal, "coverage"},
      {[](CameraCalibration& c) { c.coverage = 0.1; }, Grade::fail, "coverage"},
      {[](CameraCalibration& c) { c.tilt_spread_deg = 15; }, Grade::marginal, "tilts differ"},
      {[](CameraCalibration& c) { c.tilt_spread_deg = 2; }, Grade::fail, "all boards lie parallel"},
      {[](CameraCalibration& c) { c.mean_distance_mm = 0.1; }, Grade::fail, "other units?"},
      {[](CameraCalibration& c) { c.mean_distance_mm = 1e5; }, Grade::fail, "other units?"}};
  for (const auto& c : cases) {
    CameraCalibration spoilt = sound;
    c.spoil(spoilt);
    const Verdict verdict = judge_camera(spoilt);
    EXPECT_EQ(verdict.grade, c.grade) << c.words << "\n" << all_of(verdict);
    EXPECT_TRUE(says(verdict, c.words)) << c.words << "\n" << all_of(verdict);
    EXPECT_FALSE(verdict.next_steps.empty()) << c.words;
  }
}

TEST(CameraVerdict, ARejectedViewIsNamedAndPasses) {
  CameraCalibration one = good();
  one.rejected.push_back({3, "frame7.png", "blurred"});
  EXPECT_EQ(judge_camera(one).grade, Grade::pass);
  EXPECT_TRUE(says(judge_camera(one), "frame7.png rejected: blurred"));
}

TEST(CameraVerdict, ParallelBoardsLeaveTheFocalLengthOpenAndFail) {
  const double tilts[] = {0, 0.5};
  for (const double tilt : tilts) {
    // Held in one way, and moved along and across: whatever the noise makes of it.
    BoardScene scene;
    std::mt19937 rng(4);
    std::uniform_real_distribution<double> uniform(-1, 1);
    Views views;
    for (int i = 0; i < 12; ++i) {
      const Eigen::Matrix3d turn = rotation_exp({tilt, 0, 0}) * rotation_exp({0, 0, 2 * uniform(rng)});
      const Transform<Camera, Marker> pose(
          turn, Eigen::Vector3d(20 * uniform(rng), 10 * uniform(rng), 100 + 20 * uniform(rng)) -
                    turn * Eigen::Vector3d(27, 20, 0));
      views.push_back(scene.view(hd_lens(), pose, rng, "view"));
    }
    const auto found = calibrate_camera(views, 1920, 1080);
    const Verdict verdict = found ? judge_camera(*found) : judge_no_camera(found.error());
    EXPECT_EQ(verdict.grade, Grade::fail) << all_of(verdict);
    EXPECT_TRUE(!found || says(verdict, "parallel") || says(verdict, "focal length known to")) << all_of(verdict);
    EXPECT_FALSE(verdict.next_steps.empty());
  }
}

TEST(CameraVerdict, ALensThatIsRefocusedHalfWayIsNamed) {
  const BoardScene scene;
  CameraModel refocused = hd_lens();
  refocused.fx_px *= 1.03;
  refocused.fy_px *= 1.03;
  for (const unsigned seed : {11U, 12U}) {
    Views views = scene.views(hd_lens(), 12, seed);
    const Views others = scene.views(refocused, 12, seed + 100);
    views.insert(views.end(), others.begin(), others.end());
    const auto found = calibrate_camera(views, 1920, 1080);
    ASSERT_TRUE(found);
    EXPECT_EQ(judge_camera(*found).grade, Grade::marginal) << all_of(judge_camera(*found));
    EXPECT_TRUE(says(judge_camera(*found), "refocused or zoomed between views")) << all_of(judge_camera(*found));

    const auto sound = calibrate_camera(scene.views(hd_lens(), 24, seed), 1920, 1080);
    ASSERT_TRUE(sound && sound->focal_halves);
    EXPECT_EQ(judge_camera(*sound).grade, Grade::pass) << all_of(judge_camera(*sound));
  }
}

TEST(CameraVerdict, TheSamePoseAgainAndAgainIsOneView) {
  const BoardScene scene;
  Views views = scene.views(hd_lens(), 2, 2);
  std::mt19937 rng(8);
  const auto pose = scene.poses(1, 40)[0];
  for (int i = 0; i < 20; ++i) views.push_back(scene.view(hd_lens(), pose, rng, "still" + std::to_string(i)));
  const auto found = calibrate_camera(views, 1920, 1080);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->views.size(), 3U);
  EXPECT_EQ(judge_camera(*found).grade, Grade::fail);
  EXPECT_TRUE(says(judge_camera(*found), "the same pose as in still"));
}

TEST(CameraVerdict, TooFewViewsAreAnErrorThatSaysWhy) {
  const BoardScene scene;
  Views views = scene.views(hd_lens(), 3, 3);
  views[1].points_px[0].y() = NAN;
  const auto found = calibrate_camera(views, 1920, 1080);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, Errc::degenerate);
  EXPECT_NE(found.error().what.find("2 usable views"), std::string::npos);
  EXPECT_NE(found.error().what.find("view1: point 0 is not a finite number"), std::string::npos);
  EXPECT_EQ(judge_no_camera(found.error()).grade, Grade::fail);
  EXPECT_EQ(calibrate_camera({}, 1920, 1080).error().code, Errc::degenerate);
}

TEST(CameraVerdict, ABoardNumberedFromItsBackIsTheSameBoardAndAWrongSizeOfPictureIsNot) {
  const BoardScene scene;
  Views mirrored = scene.views(hd_lens(), 10, 4);
  const auto straight = calibrate_camera(mirrored, 1920, 1080);
  for (PatternView& view : mirrored) {
    for (Eigen::Vector3d& p : view.points_in_marker_mm) p.x() = 55 - p.x();
  }
  const auto found = calibrate_camera(mirrored, 1920, 1080);
  ASSERT_TRUE(found && straight);
  EXPECT_NEAR(found->camera.fx_px, straight->camera.fx_px, 1e-4);
  EXPECT_NEAR(found->tilt_spread_deg, straight->tilt_spread_deg, 1e-4);
  // Half the size that the pictures have: points lie outside.
  const auto small = calibrate_camera(scene.views(hd_lens(), 10, 4), 640, 360);
  ASSERT_FALSE(small);
  EXPECT_NE(small.error().what.find("outside the picture of 640x360"), std::string::npos);
  EXPECT_EQ(calibrate_camera(mirrored, 0, 1080).error().code, Errc::bad_value);
  mirrored[0].ids.pop_back();
  EXPECT_EQ(calibrate_camera(mirrored, 1920, 1080).error().code, Errc::bad_value);
}

TEST(CameraVerdict, ABoardOfAnotherShapeShowsInTheAspect) {
  // Squares that are 4 mm high were given as 5 mm.
  BoardScene scene;
  Views views = scene.views(hd_lens(), 12, 6);
  for (PatternView& view : views) {
    for (Eigen::Vector3d& p : view.points_in_marker_mm) p.y() *= 1.25;
  }
  const auto found = calibrate_camera(views, 1920, 1080);
  const Verdict verdict = found ? judge_camera(*found) : judge_no_camera(found.error());
  EXPECT_EQ(verdict.grade, Grade::fail) << all_of(verdict);
}

}  // namespace
}  // namespace birdseye::calibration
