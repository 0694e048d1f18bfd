// The safety of the live picture, in played time: nothing stale is ever shown as if it were true.
#include <gtest/gtest.h>

#include <functional>

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"
#include "host/overlay/live_picture.hpp"
#include "host/window/age_strip.hpp"
#include "host/window/live_panels.hpp"
#include "tests/support/display.hpp"
#include "tests/support/screen.hpp"

namespace birdseye::host {
namespace {

constexpr int kWidth = 64, kHeight = 48;
constexpr std::int64_t kMs = 1'000'000;

/// Covers every picture with magenta, which the video never holds.
class Magenta final : public Engine {
 public:
  void deform(const DisplacementField& /*field*/) override {}
  void undeform() override {}
  ImageRgba render(const CameraModel& camera, const Transform<Camera, Patient>& /*pose*/,
                   const RenderSettings& /*settings*/) override {
    ImageRgba image{camera.width_px, camera.height_px, {}};
    for (int i = 0; i < camera.width_px * camera.height_px; ++i) {
      image.rgba.insert(image.rgba.end(), {255, 0, 255, 255});
    }
    return image;
  }
  [[nodiscard]] std::string name() const override { return "magenta"; }
};

/// How much of a picture's colour is the overlay's: green is missing.
double magenta_in(const std::vector<std::uint8_t>& rgb) {
  double sum = 0;
  for (std::size_t i = 0; i + 2 < rgb.size(); i += 3) sum += std::max(0, rgb[i] - rgb[i + 1]);
  return sum / (255.0 * static_cast<double>(rgb.size()) / 3);
}

Setup setup() {
  return ScopeSetup::of_hand_eye({kWidth, kHeight, 60, 60, 0, 0}, 0.3, {}).registered({});
}

const TrustFigures kGood{{0.3, 2, 1}, 0.5, 2};

PoseAnswer good_pose() {
  PoseAnswer pose;
  pose.kind = PoseKind::interpolated;
  pose.tracker_from_sensor = Transform<Tracker, Sensor>();
  pose.position_sigma_mm = 0.2;
  return pose;
}

wire::VideoFrame frame_at(std::int64_t ms, const PoseAnswer& pose, int width = kWidth, int height = kHeight) {
  wire::VideoFrame frame;
  frame.info.sequence = static_cast<std::uint64_t>(ms);
  frame.info.acquired = DeviceTime{ms * kMs};
  frame.info.pose = pose;
  frame.width_px = width;
  frame.height_px = height;
  const auto size = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3;
  frame.rgb = std::make_shared<std::vector<std::uint8_t>>(size, static_cast<std::uint8_t>(80));
  return frame;
}

constexpr std::int64_t kFaultMs = 1000, kEndMs = 2500, kFrameMs = 40, kDelayMs = 30;

/// What reaches the picture at a time of the play; nothing: the frame is lost.
using Fault = std::function<std::optional<wire::VideoFrame>(std::int64_t ms, wire::VideoFrame good)>;

struct Named {
  const char* name;
  Fault fault;
  const char* words;  ///< what the picture says, half a second in
  /// Exposure of the last frame, or time of the last pose, that all was well with.
  std::int64_t last_good_ms = kFaultMs - kFrameMs;
};

std::vector<Named> faults() {
  return {{"the video stops", [](auto, auto) { return std::nullopt; }, "the video has stopped"},
          {"poses are refused",
           [](auto, wire::VideoFrame f) {
             f.info.pose = {};
             f.info.pose.reason = "the tracker is silent";
             return std::optional(f);
           },
           "the tracker is silent"},
          {"poses are predicted ever further",
           [](std::int64_t ms, wire::VideoFrame f) {
             const Duration ahead = Duration::from_ms(ms - kFaultMs);
             f.info.pose.kind = PoseKind::predicted;
             f.info.pose.age = ahead;
             if (ahead > Duration::from_ms(100)) {
               f.info.pose = {};
               f.info.pose.reason = "no pose for 100 ms";
             }
             return std::optional(f);
           },
           "no pose for 100 ms", kFaultMs},
          {"the tracker scatters",
           [](auto, wire::VideoFrame f) {
             f.info.pose.position_sigma_mm = 5;
             return std::optional(f);
           },
           "scatters by 5.0 mm"},
          {"the size changes",
           [](std::int64_t ms, const wire::VideoFrame&) {
             return std::optional(frame_at(ms, good_pose(), kWidth / 2, kHeight));
           },
           "the camera was calibrated at 64 x 48"}};
}

/// Plays frames and a fault, looking at the picture every 10 ms. look: with the time and what is shown.
void play(LivePicture& picture, const Fault& fault,
          const std::function<void(std::int64_t, const ShownPicture&)>& look) {
  for (std::int64_t ms = 0; ms < kEndMs; ms += 10) {
    const std::int64_t exposed_ms = ms - kDelayMs;
    if (exposed_ms >= 0 && exposed_ms % kFrameMs == 0) {
      auto frame = std::optional(frame_at(exposed_ms, good_pose()));
      if (exposed_ms >= kFaultMs) frame = fault(exposed_ms, *frame);
      if (frame) picture.take(*frame, {HostTime{exposed_ms * kMs}});
    }
    picture.draw();
    look(ms, picture.at(HostTime{ms * kMs}));
  }
}

TEST(LivePicture, ShowsTheOverlayWhileAllIsWell) {
  const auto engine = std::make_shared<Magenta>();
  LivePicture picture;
  picture.set_engine(engine);
  picture.set_setup(setup(), kGood);
  int overlaid = 0;
  play(
      picture, [](auto, wire::VideoFrame f) { return std::optional(f); },
      [&](std::int64_t ms, const ShownPicture& shown) {
        if (ms < 100) return;
        ASSERT_TRUE(shown.overlaid) << ms << " " << shown.reason;
        EXPECT_GT(magenta_in(*shown.rgb), 0.99);
        EXPECT_LE(shown.age_ms, 70);
        ++overlaid;
      });
  EXPECT_EQ(overlaid, 240);
}

TEST(LivePicture, AnOverlayThatIsSwitchedOffIsGoneAtOnceAndSaysSo) {
  const auto engine = std::make_shared<Magenta>();
  LivePicture picture;
  picture.set_engine(engine);
  picture.set_setup(setup(), kGood);
  for (std::int64_t ms = 0; ms < 400; ms += 40) {
    picture.take(frame_at(ms, good_pose()), {HostTime{ms * kMs}});
    picture.draw();
  }
  const HostTime now{370 * kMs};
  ASSERT_TRUE(picture.at(now).overlaid);
  picture.hide(true);
  picture.draw();
  EXPECT_FALSE(picture.at(now).overlaid);
  EXPECT_EQ(magenta_in(*picture.at(now).rgb), 0);
  EXPECT_EQ(picture.at(now).reason, "it is switched off");
  EXPECT_FALSE(picture.camera_from_patient());
  EXPECT_TRUE(picture.seen_from()) << "views can be kept meanwhile";
  picture.hide(false);
  picture.draw();
  EXPECT_TRUE(picture.at(now).overlaid);
}

TEST(LivePicture, NoStaleOverlayStaysLongerThan150MsUnderAnyFault) {
  for (const Named& one : faults()) {
    SCOPED_TRACE(one.name);
    const auto engine = std::make_shared<Magenta>();
    LivePicture picture;
    picture.set_engine(engine);
    picture.set_setup(setup(), kGood);
    std::string words;
    play(picture, one.fault, [&](std::int64_t ms, const ShownPicture& shown) {
      if (ms > one.last_good_ms + 150) {
        EXPECT_EQ(magenta_in(*shown.rgb), 0) << "at " << ms - kFaultMs << " ms";
      }
      // Nor does one that the program does not come to take away; and a picture without one says when it has stopped.
      const double seen_ms = static_cast<double>(ms) - shown.age_ms;
      EXPECT_EQ(shown.believe_until.has_value(), shown.any && !shown.stale);
      if (shown.believe_until) {
        EXPECT_LE(static_cast<double>(shown.believe_until->ns) * 1e-6, seen_ms + (shown.overlaid ? 150 : 350));
      }
      if (ms == kFaultMs + 500) words = shown.reason;
    });
    EXPECT_NE(words.find(one.words), std::string::npos) << words;
  }
}

TEST(LivePicture, NothingIsDrawnWithoutRegistrationOrWithABadOne) {
  const auto engine = std::make_shared<Magenta>();
  LivePicture picture;
  picture.set_engine(engine);
  picture.take(frame_at(0, good_pose()), {HostTime{0}});
  picture.draw();
  EXPECT_EQ(picture.at(HostTime{kMs}).reason, "the patient is not registered yet");
  TrustFigures bad_fit = kGood;
  bad_fit.fre_mm = 9;
  picture.set_setup(setup(), bad_fit);
  picture.take(frame_at(40, good_pose()), {HostTime{40 * kMs}});
  picture.draw();
  const ShownPicture bad = picture.at(HostTime{50 * kMs});
  EXPECT_FALSE(bad.overlaid);
  EXPECT_EQ(bad.reason, "the fiducials fit to 9.0 mm only");
}

TEST(LivePicture, NothingIsDrawnByAFigureThatNobodyKnows) {
  LivePicture picture;
  picture.set_engine(std::make_shared<Magenta>());
  picture.set_setup(setup(), {});
  picture.take(frame_at(0, good_pose()), {HostTime{0}});
  picture.draw();
  const ShownPicture shown = picture.at(HostTime{10 * kMs});
  EXPECT_FALSE(shown.overlaid);
  EXPECT_EQ(magenta_in(*shown.rgb), 0);
  EXPECT_EQ(shown.reason, "how well the camera is calibrated is not known");
}

TEST(LivePicture, AFrameIsJudgedByTheSetupThatDrawsIt) {
  LivePicture picture;
  picture.set_engine(std::make_shared<Magenta>());
  picture.set_setup(setup(), kGood);
  picture.take(frame_at(0, good_pose()), {HostTime{0}});
  picture.set_setup(setup(), {});  // between the frame's coming and its drawing
  picture.draw();
  const ShownPicture shown = picture.at(HostTime{10 * kMs});
  EXPECT_FALSE(shown.overlaid);
  EXPECT_EQ(magenta_in(*shown.rgb), 0);
  EXPECT_EQ(shown.reason, "how well the camera is calibrated is not known");
  EXPECT_FALSE(picture.camera_from_patient());
}

TEST(LivePicture, APoseIsTheNewestFramesAlsoBeforeThatIsDrawn) {
  LivePicture picture;
  picture.set_engine(std::make_shared<Magenta>());
  picture.set_setup(setup(), kGood);
  picture.take(frame_at(0, good_pose()), {HostTime{0}});
  picture.draw();
  PoseAnswer moved = good_pose();
  moved.tracker_from_sensor = Transform<Tracker, Sensor>(Eigen::Matrix3d::Identity(), {7, 0, 0});
  picture.take(frame_at(40, moved), {HostTime{40 * kMs}});
  ASSERT_TRUE(picture.camera_from_patient());
  EXPECT_NEAR(picture.camera_from_patient()->translation().x(), -7, 1e-12);
  PoseAnswer refused;
  refused.reason = "the tracker is silent";
  picture.take(frame_at(80, refused), {HostTime{80 * kMs}});
  EXPECT_FALSE(picture.camera_from_patient());
}

TEST(LivePicture, AVideoThatHasStoppedLosesItsColours) {
  LivePicture picture;
  auto frame = frame_at(0, {});
  frame.rgb = std::make_shared<std::vector<std::uint8_t>>(std::vector<std::uint8_t>(kWidth * kHeight * 3, 200));
  picture.take(frame, {HostTime{0}});
  EXPECT_FALSE(picture.at(HostTime{200 * kMs}).stale);
  const ShownPicture stopped = picture.at(HostTime{400 * kMs});
  EXPECT_TRUE(stopped.stale);
  EXPECT_EQ(stopped.rgb->front(), 100);
  // Who has frozen it wants to see what is in it.
  picture.freeze(true);
  picture.draw();
  EXPECT_EQ(picture.at(HostTime{400 * kMs}).rgb->front(), 200);
  picture.freeze(false);
  picture.draw();
  EXPECT_EQ(picture.at(HostTime{400 * kMs}).rgb->front(), 100);
  // It comes back with the next frame.
  picture.take(frame_at(440, {}), {HostTime{440 * kMs}});
  EXPECT_FALSE(picture.at(HostTime{450 * kMs}).stale);
}

TEST(LivePicture, AClockThatStartsAnewDoesNotStopIt) {
  const auto engine = std::make_shared<Magenta>();
  LivePicture picture;
  picture.set_engine(engine);
  picture.set_setup(setup(), kGood);
  picture.take(frame_at(90'000, good_pose()), {HostTime{0}});
  picture.take(frame_at(10, good_pose()), {HostTime{40 * kMs}});
  picture.draw();
  EXPECT_TRUE(picture.at(HostTime{50 * kMs}).overlaid);
  EXPECT_EQ(picture.frames_skipped(), 1U);
}

TEST(AgeStrip, HoldsTheNewestAndTheFiguresOfAll) {
  AgeStrip strip;
  EXPECT_EQ(strip.percentile_ms(0.5), 0);
  for (int i = 1; i <= 1000; ++i) strip.add(i * 0.1);
  EXPECT_NEAR(strip.percentile_ms(0.5), 50, 0.6);
  EXPECT_NEAR(strip.percentile_ms(0.95), 95, 0.6);
  EXPECT_DOUBLE_EQ(strip.most_ms(), 100);
  EXPECT_EQ(strip.newest().size(), AgeStrip::kShown);
  EXPECT_FLOAT_EQ(strip.newest().back(), 100);
  strip.add(5000);
  EXPECT_DOUBLE_EQ(strip.percentile_ms(1), 2000);  // the last bin says no more than that
}

class LiveWindowTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    display_ = std::make_unique<birdseye::testing::Display>("1280x720");
    ::setenv("DISPLAY", display_->name().c_str(), 1);
    ::unsetenv("WAYLAND_DISPLAY");
  }
  static void TearDownTestSuite() { display_.reset(); }
  static std::unique_ptr<birdseye::testing::Display> display_;
};
std::unique_ptr<birdseye::testing::Display> LiveWindowTest::display_;

TEST_F(LiveWindowTest, OnTheScreenTooNoStaleOverlayStays) {
  LiveWindow::Settings settings;
  settings.width_px = 1000;
  settings.height_px = 600;
  settings.scale = 1;
  auto window = LiveWindow::open(settings);
  ASSERT_TRUE(window) << window.error().what;
  const AgeStrip ages;
  PanelFacts facts;
  facts.ages = &ages;
  const OperationView operation;
  for (const Named& one : faults()) {
    SCOPED_TRACE(one.name);
    const auto engine = std::make_shared<Magenta>();
    LivePicture picture;
    picture.set_engine(engine);
    picture.set_setup(setup(), kGood);
    std::uint64_t changes = 0;
    int seen = 0;
    play(picture, one.fault, [&](std::int64_t ms, const ShownPicture& shown) {
      if (ms % 50 != 0) return;  // a window that is drawn twenty times a second
      if (shown.any && shown.changes != changes)
        (*window)->set_picture(LiveWindow::Slot::video, {*shown.rgb, shown.width_px, shown.height_px});
      changes = shown.changes;
      (*window)->begin_frame();
      draw_panels(**window, operation, shown, facts);
      (*window)->end_frame();
      const double magenta = magenta_in((*window)->shot().rgb);
      (*window)->swap();
      if (ms > 100 && ms < kFaultMs) seen += magenta > 0.1 ? 1 : 0;
      if (ms > one.last_good_ms + 150) {
        EXPECT_LT(magenta, 0.02) << "at " << ms - kFaultMs << " ms";
      }
    });
    EXPECT_GT(seen, 10);
  }
}

TEST_F(LiveWindowTest, AKeyThatIsLetGoAtOnceCounts) {
  LiveWindow::Settings settings;
  settings.width_px = 640;
  settings.height_px = 480;
  auto window = LiveWindow::open(settings);
  ASSERT_TRUE(window) << window.error().what;
  birdseye::testing::Screen screen(display_->name());
  const auto keys = [&](bool again) {
    (*window)->begin_frame(again);
    const auto pressed = (*window)->keys();
    (*window)->end_frame();
    (*window)->swap();
    return pressed;
  };
  EXPECT_TRUE(keys(false).empty());
  constexpr std::uint8_t kSpace = 65;
  screen.tap(kSpace);
  EXPECT_TRUE(keys(true).empty()) << "of the frame before, which is drawn again";
  EXPECT_EQ(keys(false), std::vector<std::string>{"space"});
  EXPECT_TRUE(keys(false).empty());
}

TEST_F(LiveWindowTest, WhatStaysOnTheScreenTooLongIsCovered) {
  constexpr int kSide = 200;
  LiveWindow::Settings settings;
  settings.width_px = 640;
  settings.height_px = 480;
  auto opened = LiveWindow::open(settings);
  ASSERT_TRUE(opened) << opened.error().what;
  LiveWindow& window = **opened;
  window.cover_when_still(kSide, {std::vector<std::uint8_t>{200, 10, 20}, 1, 1});
  birdseye::testing::Screen screen(display_->name());
  const auto draw = [&](LiveWindow::Believed until) {
    window.begin_frame();
    window.end_frame();
    window.swap(until);
  };
  const auto red_at = [&](int x, int y) { return static_cast<int>(screen.grab(x, y, 1, 1).at(0)); };
  const auto look = [&](int video, int side) {
    EXPECT_NEAR(red_at(kSide + 1, 1), video, 2);
    EXPECT_NEAR(red_at(639, 479), video, 2);
    EXPECT_NEAR(red_at(kSide - 1, 10), side, 2);
  };
  draw(std::nullopt);
  sleep_for(Duration::from_ms(300));
  look(23, 23);  // what is not to be believed at all is not covered: it says so itself
  EXPECT_EQ(window.stood_still(), 0);
  for (int times = 1; times <= 3; ++times) {
    draw(host_now() + Duration::from_ms(100));
    // This thread stands still, and a screen shows for ever what was drawn last.
    sleep_for(Duration::from_ms(600));
    EXPECT_EQ(window.stood_still(), times);
    look(200, 23);
    draw(std::nullopt);
    look(23, 23);
  }
}

}  // namespace
}  // namespace birdseye::host
