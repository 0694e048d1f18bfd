#include "host/overlay/sudden_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/looking_about.hpp"

namespace birdseye::host {
namespace {

using Vector = Eigen::Vector3d;

/// Asks of each frame, and keeps when it was told that the video moved otherwise.
struct Watcher {
  std::optional<double> target_mm = 100;
  std::vector<double> sudden_s{};
  int frames = 0;
  SuddenMotion sudden{};

  void take(DeviceTime acquired, const Transform<Tracker, Sensor>& pose) { sudden.take(acquired, pose); }
  void take(const wire::VideoFrame& frame, const ScopeSetup& scope) {
    ++frames;
    if (sudden.take(frame, picture_to_follow(frame), scope, target_mm))
      sudden_s.push_back((frame.info.acquired - DeviceTime{}).seconds());
  }
};
using LookingAbout = testing::LookingAbout<Watcher>;

/// From the tenth second on everything that is seen is elsewhere. After how many frames it is told; empty: never.
std::optional<int> told_of_a_jump(const Vector& by_mm, std::optional<double> target_mm) {
  LookingAbout about;
  about.motion.target_mm = target_mm;
  about.look(0, 10);
  about.motion.sudden_s.clear();
  about.scene_moves = [&by_mm](double) { return by_mm; };
  about.look(10, 0.2);
  if (about.motion.sudden_s.empty()) return std::nullopt;
  return static_cast<int>(std::lround((about.motion.sudden_s.front() - 10) / 0.04));
}

TEST(SuddenMotion, SaysNothingWhereVideoAndPosesAgree) {
  for (const double haste : {0.0, 1.0, 1.5}) {
    LookingAbout about;
    about.haste = haste;
    about.look(0, 20);
    EXPECT_EQ(about.motion.frames, 500);
    EXPECT_LE(about.motion.sudden_s.size(), 1U) << haste;
  }
}

TEST(SuddenMotion, TellsOfTheFirstFrameThatHasMovedOtherwise) {
  for (const Vector& by_mm : {Vector(12, 0, 0), Vector(0, -12, 0), Vector(9, 9, 0), Vector(300, 0, 0)})
    EXPECT_EQ(told_of_a_jump(by_mm, 100), 0) << by_mm.transpose();
}

TEST(SuddenMotion, TellsOfTheFirstFrameOfAScopeThatWasTurnedInItsHolder) {
  LookingAbout about;
  about.look(0, 10);
  about.motion.sudden_s.clear();
  about.turned = {rotation_exp(Vector(0, 0, 30 * kRadPerDeg)), Vector::Zero()};
  about.look(10, 0.2);
  ASSERT_FALSE(about.motion.sudden_s.empty());
  EXPECT_NEAR(about.motion.sudden_s.front(), 10, 1e-9);
}

TEST(SuddenMotion, IsSilentOfWhatIsLessThanThePosesScatter) {
  EXPECT_FALSE(told_of_a_jump({1, 1, 0}, 100));
}

/// The poses jump across the view and the video stands still: so it would for places that are far away. Where the
/// target is drawn tells that they are not.
TEST(SuddenMotion, APoseThatJumpsIsToldByHowFarTheTargetIs) {
  const auto jump = [](std::optional<double> target_mm) {
    LookingAbout about;
    about.haste = 0;
    about.motion.target_mm = target_mm;
    about.look(0, 10);
    about.motion.sudden_s.clear();
    // Scope and scene go together, by as much as the tracker is bumped: what is seen stays as it was.
    about.bumped_mm = Vector(14, 0, 0);
    about.look(10, 0.2);
    return !about.motion.sudden_s.empty();
  };
  EXPECT_TRUE(jump(100));
  EXPECT_FALSE(jump(std::nullopt));
}

}  // namespace
}  // namespace birdseye::host
