// What lies over a picture, and when.
#include "host/overlay/frame_painter.hpp"

#include <gtest/gtest.h>

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "host/overlay/surface_cues.hpp"

namespace birdseye::host {
namespace {

const TrustFigures kGoodFigures{{0.3, 2, 1}, 0.5, 2};

/// Draws the same picture, whatever it is asked for.
class Drawn final : public Engine {
 public:
  explicit Drawn(ImageRgba image) : image_(std::move(image)) {}
  void deform(const DisplacementField& /*field*/) override {}
  void undeform() override {}
  ImageRgba render(const CameraModel& /*camera*/, const Transform<Camera, Patient>& /*pose*/,
                   const RenderSettings& /*settings*/) override {
    return image_;
  }
  [[nodiscard]] std::string name() const override { return "drawn"; }

 private:
  ImageRgba image_;
};

CameraModel camera_of(int width_px, int height_px) {
  return {width_px, height_px, 60, 60, 0, 0};
}

/// A picture of three pixels, over which lie nothing, half a red, and white.
const std::vector<std::uint8_t> kVideo{10, 20, 30, 200, 100, 50, 7, 8, 9};
const std::vector<std::uint8_t> kOverlaid{10, 20, 30, 164, 50, 25, 255, 255, 255};
ImageRgba red_and_white() {
  return {3, 1, {0, 0, 0, 0, 64, 0, 0, 128, 255, 255, 255, 255}};
}

std::vector<std::uint8_t> painted(const TrustFigures& figures, const OverlayLook& look = {},
                                  const ImageRgba& image = red_and_white()) {
  Drawn engine(image);
  return paint_still({kVideo, camera_of(3, 1), {}}, engine, look, figures).rgb;
}

/// Where a check changes a figure, the circle must not forget the tracker's noise.
TEST(FramePainter, KnowsTheNoiseOnWhereScopeAndTargetAreAsBefore) {
  const ScopeSetup scope = ScopeSetup::of_hand_eye(camera_of(30, 30), 0.3, calibration::HandEyeResult());
  const auto setup_at = [&](double x_mm) {
    return scope.registered(Transform<Tracker, Patient>(Eigen::Matrix3d::Identity(), {x_mm, 0, 100}));
  };
  TrustFigures figures = kGoodFigures;
  figures.target_in_patient_mm = Eigen::Vector3d(1, 2, 3);
  FramePainter painter{OverlayGate::Settings()};
  painter.set_setup(setup_at(0), figures);
  for (int i = 0; i < 30; ++i)
    painter.take(DeviceTime{i * 10'000'000},
                 Transform<Tracker, Sensor>(Eigen::Matrix3d::Identity(), {i % 2 * 1.0, 0, 0}));
  ASSERT_TRUE(painter.jitter().rms_mm());
  figures.target_mm = 3;
  painter.set_setup(setup_at(0), figures);
  EXPECT_TRUE(painter.jitter().rms_mm());
  painter.set_setup(std::nullopt, {});
  painter.set_setup(setup_at(0), figures);
  EXPECT_TRUE(painter.jitter().rms_mm()) << "also after a moment in which nothing was drawn";
  painter.set_setup(setup_at(5), figures);
  EXPECT_FALSE(painter.jitter().rms_mm()) << "the patient was registered anew";
}

TEST(PaintStill, LeavesTheVideoWhereThereIsNoOverlayAndBlendsWhereThereIs) {
  EXPECT_EQ(painted(kGoodFigures), kOverlaid);
  OverlayLook look;
  look.opacity = 0;
  EXPECT_EQ(painted(kGoodFigures, look), kVideo);
  look.opacity = 0.5;
  EXPECT_EQ(painted(kGoodFigures, look), (std::vector<std::uint8_t>{10, 20, 30, 182, 75, 37, 131, 132, 132}));
}

TEST(PaintStill, AnOverlayOfAnotherSizeIsNotDrawn) {
  EXPECT_EQ(painted(kGoodFigures, {}, {2, 1, {255, 255, 255, 255, 255, 255, 255, 255}}), kVideo);
}

TEST(PaintStill, IsDrawnByFiguresOrBySomebodyWhoAnswersForThem) {
  EXPECT_EQ(painted({}), kVideo) << "nothing is known";
  EXPECT_EQ(painted(vouched_for({})), kOverlaid);
  TrustFigures poor = kGoodFigures;
  poor.fre_mm = 9;
  EXPECT_EQ(painted(vouched_for(poor)), kVideo);
  Drawn engine(red_and_white());
  const PaintedStill bare = paint_still({kVideo, camera_of(3, 1), {}}, engine, {}, {});
  EXPECT_EQ(bare.volume.rgba, red_and_white().rgba) << "alone it may be seen";
}

TEST(PaintStill, TheSurfacesEdgesAndHighlightsStayInFront) {
  constexpr int kWide = 60, kHigh = 40;
  std::vector<std::uint8_t> video;
  for (int i = 0; i < kWide * kHigh; ++i)
    video.insert(video.end(), 3, static_cast<std::uint8_t>(i % kWide < kWide / 2 ? 90 : 250));
  Drawn engine({kWide, kHigh, std::vector<std::uint8_t>(std::size_t{4} * kWide * kHigh, 255)});
  OverlayLook look;
  look.surface_in_front = true;
  const auto rgb = paint_still({video, camera_of(kWide, kHigh), {}}, engine, look, kGoodFigures).rgb;
  const auto cues = surface_cues({video, kWide, kHigh});
  int hidden = 0;
  for (std::size_t i = 0; i < cues.size(); ++i) {
    // White over the video: what is missing of it is what the cue keeps.
    const double expected = 255 - (255 - video[3 * i]) * cues[i] / 255.0;
    EXPECT_NEAR(rgb[3 * i], expected, 1.5) << i;
    hidden += cues[i] > 0 ? 1 : 0;
  }
  EXPECT_GT(hidden, kHigh);
  EXPECT_LT(hidden, kWide * kHigh);
}

wire::VideoFrame frame_at(std::int64_t ms) {
  wire::VideoFrame frame;
  frame.info.acquired = DeviceTime{ms * 1'000'000};
  frame.info.pose.kind = PoseKind::interpolated;
  frame.info.pose.tracker_from_sensor = Transform<Tracker, Sensor>();
  frame.info.pose.position_sigma_mm = 0.2;
  frame.width_px = 3;
  frame.height_px = 1;
  frame.rgb = std::make_shared<std::vector<std::uint8_t>>(kVideo);
  return frame;
}

TEST(FramePainter, DrawsOnceThereIsASetupWithFiguresThatAreGood) {
  const auto setup = ScopeSetup::of_hand_eye(camera_of(3, 1), 0.3, {}).registered({});
  Drawn engine(red_and_white());
  FramePainter painter;
  const auto paint = [&painter, &engine](const wire::VideoFrame& frame) {
    return painter.paint(frame, painter.decide(frame), engine, {});
  };
  EXPECT_FALSE(paint(frame_at(0)).has_value()) << "no setup";
  painter.set_setup(setup, {});
  EXPECT_FALSE(paint(frame_at(40)).has_value()) << "nothing is known of it";
  painter.set_setup(setup, kGoodFigures);
  const auto drawn = paint(frame_at(80));
  ASSERT_TRUE(drawn.has_value());
  EXPECT_EQ(drawn->rgb, kOverlaid);
  wire::VideoFrame other = frame_at(120);
  other.width_px = 1;
  other.height_px = 3;
  EXPECT_FALSE(paint(other).has_value()) << "of another camera";
}

}  // namespace
}  // namespace birdseye::host
