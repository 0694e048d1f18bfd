#include "drivers/video/v4l2_controls.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>

namespace birdseye::drivers {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// A camera as UVC has them: a value cannot be set while its automatism is on, and jumps to a default when that goes
/// off.
class WebcamControls final : public ControlPort {
 public:
  struct Control {
    Range range;
    int value;
  };
  std::optional<Range> range(std::uint32_t id) override {
    const auto found = controls.find(id);
    return found == controls.end() ? std::nullopt : std::optional(found->second.range);
  }
  std::optional<int> get(std::uint32_t id) override {
    const auto found = controls.find(id);
    return found == controls.end() ? std::nullopt : std::optional(found->second.value);
  }
  Result<void> set(std::uint32_t id, int value) override {
    const auto found = controls.find(id);
    if (found == controls.end()) return Error{Errc::io, "no such control"};
    if (id == V4L2_CID_EXPOSURE_AUTO && value == V4L2_EXPOSURE_MANUAL && !has_manual) return Error{Errc::io, "refused"};
    if (id == V4L2_CID_EXPOSURE_ABSOLUTE && get(V4L2_CID_EXPOSURE_AUTO) == V4L2_EXPOSURE_APERTURE_PRIORITY) {
      return Error{Errc::io, "automatic"};
    }
    if (id == V4L2_CID_WHITE_BALANCE_TEMPERATURE && get(V4L2_CID_AUTO_WHITE_BALANCE) == 1) {
      return Error{Errc::io, "automatic"};
    }
    if (id == V4L2_CID_AUTO_WHITE_BALANCE && value == 0 && sticky_white_balance) return {};
    found->second.value = value;
    if (id == V4L2_CID_EXPOSURE_AUTO && value != V4L2_EXPOSURE_APERTURE_PRIORITY) {
      controls[V4L2_CID_EXPOSURE_ABSOLUTE].value = 156;
    }
    return {};
  }

  bool has_manual = true;
  bool sticky_white_balance = false;
  std::map<std::uint32_t, Control> controls = {
      {V4L2_CID_EXPOSURE_AUTO, {{0, 3}, V4L2_EXPOSURE_APERTURE_PRIORITY}},
      {V4L2_CID_EXPOSURE_ABSOLUTE, {{3, 2047}, 80}},
      {V4L2_CID_AUTO_WHITE_BALANCE, {{0, 1}, 1}},
      {V4L2_CID_WHITE_BALANCE_TEMPERATURE, {{2800, 6500}, 4100}},
      {V4L2_CID_GAIN, {{0, 255}, 12}},
  };
};

TEST(V4l2Controls, LockHoldsWhatTheCameraHadChosen) {
  WebcamControls camera;
  V4l2Controls controls(camera);
  EXPECT_FALSE(controls.exposure());
  const auto report = controls.lock();
  EXPECT_THAT(report.refused, IsEmpty());
  EXPECT_THAT(report.done, ElementsAre("exposure held at 8000 us", "white balance held at 4100 K"));
  EXPECT_EQ(camera.get(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(camera.get(V4L2_CID_EXPOSURE_ABSOLUTE), 80);
  EXPECT_EQ(camera.get(V4L2_CID_AUTO_WHITE_BALANCE), 0);
  ASSERT_TRUE(controls.exposure());
  EXPECT_EQ(controls.exposure()->ns, 8'000'000);
}

TEST(V4l2Controls, UnlockGivesBackWhatLockTook) {
  WebcamControls camera;
  V4l2Controls controls(camera);
  (void)controls.lock();
  EXPECT_THAT(controls.lock().done, IsEmpty());
  EXPECT_THAT(controls.unlock().done, ElementsAre("exposure automatic again", "white balance automatic again"));
  EXPECT_EQ(camera.get(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_APERTURE_PRIORITY);
  EXPECT_EQ(camera.get(V4L2_CID_AUTO_WHITE_BALANCE), 1);
  EXPECT_THAT(controls.unlock().done, IsEmpty());
}

TEST(V4l2Controls, WhatWasSetByHandStaysSetAfterUnlock) {
  WebcamControls camera;
  V4l2Controls controls(camera);
  CameraSettings settings;
  settings.exposure_us = 5000;
  EXPECT_THAT(controls.apply(settings).done, ElementsAre("exposure 5000 us"));
  (void)controls.lock();
  (void)controls.unlock();
  EXPECT_EQ(camera.get(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(camera.get(V4L2_CID_EXPOSURE_ABSOLUTE), 50);
}

TEST(V4l2Controls, TakesShutterPriorityWhereThereIsNoManualMode) {
  WebcamControls camera;
  camera.has_manual = false;
  V4l2Controls controls(camera);
  EXPECT_THAT(controls.lock().refused, IsEmpty());
  EXPECT_EQ(camera.get(V4L2_CID_EXPOSURE_AUTO), V4L2_EXPOSURE_SHUTTER_PRIORITY);
  EXPECT_TRUE(controls.exposure());
}

TEST(V4l2Controls, SaysWhatCouldNotBeSet) {
  WebcamControls camera;
  camera.sticky_white_balance = true;
  V4l2Controls controls(camera);
  EXPECT_THAT(controls.lock().refused, ElementsAre("white balance: the camera goes on changing it by itself"));

  camera.controls.erase(V4L2_CID_GAIN);
  CameraSettings settings;
  settings.exposure_us = 900'000;
  settings.gain = 3;
  settings.white_balance_k = 5000;
  const auto report = controls.apply(settings);
  EXPECT_THAT(report.done, IsEmpty());
  EXPECT_THAT(report.refused, ElementsAre("exposure 900000 us: the camera takes 300 us to 204700 us",
                                          "gain 3: the camera has no such control",
                                          "white balance 5000 K: the camera goes on changing it by itself"));
}

}  // namespace
}  // namespace birdseye::drivers
