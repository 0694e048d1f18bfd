#include "host/operation/replay_player.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "tests/support/render_scene.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/textured_scene.hpp"

namespace birdseye::host {
namespace {

using Vector = Eigen::Vector3d;

const CameraModel kScope{192, 144, 150, 150, 95.5, 71.5};
const Transform<Camera, Sensor> kCameraFromSensor{rotation_exp(Vector(0.2, -0.1, 0.4)), Vector(5, -3, -300)};

/// Ten seconds of a scope that looks about, replayed by a hand-eye that may be another's.
struct ReplayedLook {
  Transform<Camera, Sensor> told = kCameraFromSensor;
  bool motion_check = true;
  bool pattern = true;
  bool single_poses = true;  ///< else there are the frames' own alone, as in a sequence of PLUS
  std::string row{};         ///< of the last frame

  Replayed play() {
    const testing::Scratch scratch;
    ScopeFigures stated;
    stated.camera_rms_px = 0.2;
    stated.held_out_px = 1;
    stated.held_out_mm = 0.7;
    const ReplaySetup setup{*ScopeSetup::of_values(kScope, std::nullopt, told, stated), {}, {}, {}, 0.5};
    TrustFigures figures;
    figures.scope = setup.scope.figures();
    figures.fre_mm = figures.target_mm = 0.5;
    figures.target_in_patient_mm = Vector::Zero();
    const Volume ct = testing::scene();
    const TransferFunction transfer = testing::soft();
    const auto engine = make_engine("cpu", ct, transfer);
    ReplayPlayer player({scratch.path(), 1000, 0, {}, "scope", motion_check, true, {}}, setup, figures, **engine);
    testing::TexturedScene scene(Vector(0, 0, 0));
    for (int i = 0; i < 1000; ++i) {
      const double t_s = i * 0.01;
      const Eigen::Matrix3d turn =
          rotation_exp(Vector(0.3 * std::sin(1.4 * t_s), 0.35 * std::sin(1.1 * t_s + 1), 0.4 * std::sin(0.8 * t_s)));
      const Transform<Camera, Patient> view(
          turn, Vector(8 * std::sin(t_s), 9 * std::cos(1.3 * t_s), 100 + 15 * std::sin(0.9 * t_s)));
      const auto sensor = view.inverse() * kCameraFromSensor;
      const Transform<Tracker, Sensor> tracker_from_sensor(sensor.rotation(), sensor.translation());
      const DeviceTime at{10'000'000LL * i};
      if (single_poses) player.take(wire::Birds{at, {{"scope", tracker_from_sensor}}});
      if (i % 4 != 0) continue;
      wire::VideoFrame frame;
      frame.info.sequence = static_cast<std::uint64_t>(i);
      frame.info.acquired = at;
      frame.info.latency = Duration{0};
      frame.info.pose.kind = PoseKind::exact;
      frame.info.pose.tracker_from_sensor = tracker_from_sensor;
      frame.width_px = kScope.width_px;
      frame.height_px = kScope.height_px;
      auto rgb = scene.picture(kScope, view);
      if (!pattern) std::fill(rgb.begin(), rgb.end(), std::uint8_t{90});
      frame.rgb = std::make_shared<std::vector<std::uint8_t>>(std::move(rgb));
      EXPECT_TRUE(player.take(frame));
    }
    Replayed done = player.done();
    const auto end = done.table.rfind('\n', done.table.size() - 2);
    row = done.table.substr(end + 1);
    return done;
  }
};

TEST(ReplayPlayer, DrawsOverVideoThatMovesAsThePosesSay) {
  ReplayedLook look;
  const Replayed done = look.play();
  EXPECT_EQ(done.overlaid, done.frames) << look.row;
  EXPECT_TRUE(done.video_told);
}

TEST(ReplayPlayer, DrawsNothingOnceTheVideoShowsAnotherHandEye) {
  ReplayedLook look;
  look.told = Transform<Camera, Camera>(rotation_exp(Vector(0, 0, 30 * kRadPerDeg)), Vector::Zero()) * look.told;
  const Replayed done = look.play();
  EXPECT_LT(done.overlaid, 50U) << "of " << done.frames << ": two seconds are time to see it";
  EXPECT_NE(look.row.find("video and poses do not agree"), std::string::npos) << look.row;
  look.motion_check = false;
  EXPECT_EQ(look.play().overlaid, done.frames) << "asked not to look";
}

TEST(ReplayPlayer, WhereThereAreNoSinglePosesTheFramesOwnTell) {
  ReplayedLook look;
  look.single_poses = false;
  const Replayed right = look.play();
  EXPECT_EQ(right.overlaid, right.frames) << look.row;
  EXPECT_TRUE(right.video_told);
  look.told = Transform<Camera, Camera>(rotation_exp(Vector(0, 0, 30 * kRadPerDeg)), Vector::Zero()) * look.told;
  EXPECT_LT(look.play().overlaid, 50U);
  EXPECT_NE(look.row.find("video and poses do not agree"), std::string::npos) << look.row;
}

TEST(ReplayPlayer, SaysThatAPictureWithoutAPatternTellsNothing) {
  ReplayedLook look;
  look.pattern = false;
  const Replayed done = look.play();
  EXPECT_EQ(done.overlaid, done.frames);
  EXPECT_FALSE(done.video_told);
}

TEST(ReplayPlayer, ReasonsThatDifferInFiguresAloneAreOne) {
  const std::map<std::string, std::size_t> reasons{{"the target may be off by 9 mm, by all that is counted", 3},
                                                   {"the target may be off by 48211 mm, by all that is counted", 2},
                                                   {"the tracker scatters by 0.8 mm", 1},
                                                   {"the tracker scatters by -1.2 mm", 1},
                                                   {"the reference \"bird 2\" was lost", 4},
                                                   {"the video is 64 x 48", 5}};
  const std::map<std::string, std::size_t> alike{{"the target may be off by .. mm, by all that is counted", 5},
                                                 {"the tracker scatters by .. mm", 2},
                                                 {"the reference \"bird 2\" was lost", 4},
                                                 {"the video is 64 x 48", 5}};
  EXPECT_EQ(alike_reasons(reasons), alike);
}

}  // namespace
}  // namespace birdseye::host
