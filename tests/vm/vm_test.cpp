// birdseyed as it was built, against the drivers of Debian's own kernel, in a virtual machine that is booted once for
// all of these tests (docs/manual/vm-test.md). They look at it from outside: at its wire, and at the world around it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>

#include "calibration/time/clock_line.hpp"
#include "tests/support/programs_folder.hpp"
#include "tests/vm/cart.hpp"
#include "tests/vm/machine.hpp"

namespace birdseye::vm {
namespace {

using wire::Birds;
using wire::Status;
using wire::VideoFrame;

std::unique_ptr<Machine> g_machine;

class TheMachine : public ::testing::Environment {
  void SetUp() override {
    g_machine = std::make_unique<Machine>("out/vm-test");
    g_machine->must("start_vivid && start_loopback && start_gpio && wait_for /dev/ttyUSB0");
  }
  void TearDown() override { g_machine.reset(); }
};

/// The simulated tracker's first bird goes round a circle, once in two seconds.
double angle_of(const Birds& birds) {
  const Eigen::Vector3d place = birds.birds.at(0).tracker_from_sensor.translation() - Eigen::Vector3d(400, 0, 0);
  EXPECT_NEAR(place.norm(), 200, 0.5);
  EXPECT_NEAR(place.z(), 0, 0.5);
  return std::atan2(place.y(), place.x());
}

/// The angle of each pose against its stamp: they go together. Only coarsely so, for an emulated processor stops now
/// and then for longer than a record takes; how exact stamps are is for tests on a processor of their own.
void expect_poses_that_tell_the_time(const std::vector<Birds>& all) {
  ASSERT_FALSE(all.empty());
  for (std::size_t i = 1; i < all.size(); ++i) {
    const double passed_s = (all[i].acquired - all[0].acquired).seconds();
    const double turned_s = (angle_of(all[i]) - angle_of(all[0])) / std::numbers::pi;
    EXPECT_GT(all[i].acquired, all[i - 1].acquired);
    ASSERT_LT(std::abs(std::remainder(passed_s - turned_s, 2.0)), 0.4) << "measurement " << i;
  }
}

template <typename Self>
class WithCart : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (!g_machine->up()) return;
    Self::prepare();
    cart_ = std::make_unique<Cart>(*g_machine, Self::kName, Self::kConfig);
  }
  static void TearDownTestSuite() { cart_.reset(); }
  void SetUp() override {
    if (!g_machine->up()) GTEST_FAIL() << "no virtual machine";
  }
  static Cart& cart() { return *cart_; }
  static void prepare() {}

 private:
  static inline std::unique_ptr<Cart> cart_;
};

void expect_a_frame_with_a_pose(Cart& cart) {
  std::string refusal;
  EXPECT_TRUE(cart.next<VideoFrame>("frame with a pose", [&](const VideoFrame& frame) {
    refusal = frame.info.pose.reason;
    return frame.info.pose.kind != PoseKind::refused;
  })) << refusal;
}

void expect_the_adapter_missed_and_found(Cart& cart, const std::string& name) {
  g_machine->adapter().send("unplug");
  EXPECT_TRUE(cart.next<Status>("word of the tracker's loss",
                                [&](const Status& s) { return !s.ok && s.text.find(name) != std::string::npos; }));
  EXPECT_EQ(cart.some<VideoFrame>("frames", 10).size(), 10U);
  g_machine->adapter().send("plug");
  EXPECT_TRUE(cart.next<Status>("word of the tracker's return", [](const Status& s) { return s.ok; }));
  expect_poses_that_tell_the_time(cart.some<Birds>("poses", 50));
}

class ThroughKernelTty : public WithCart<ThroughKernelTty> {
 public:
  static constexpr const char* kName = "kernel-tty";
  static constexpr const char* kConfig = R"(
[tracker]
device = "/dev/ttyUSB0"
[camera]
source = "v4l2:/dev/video0"
width = 320
height = 180
rate_hz = 25
)";
};

TEST_F(ThroughKernelTty, TheGuestIsWhatATechnicianWouldFind) {
  EXPECT_EQ(g_machine->must("cat /sys/bus/usb/devices/1-1/serial"), Machine::kAdapterSerial);
  EXPECT_EQ(g_machine->must("basename $(readlink /sys/bus/usb-serial/devices/ttyUSB0/driver)"), "ftdi_sio");
  EXPECT_NE(g_machine->must("dmesg").find("Detected FT232R"), std::string::npos);
}

TEST_F(ThroughKernelTty, OpeningThePortResetsTheTracker) {
  // What ftdi_sio does, and why the driver configures the unit at every start.
  EXPECT_FALSE(g_machine->adapter().wait_for(R"("rts":true)", Deadline::after(Duration::from_ms(5000))).empty());
  EXPECT_FALSE(g_machine->adapter().wait_for(R"("rts":false)", Deadline::after(Duration::from_ms(5000))).empty());
}

TEST_F(ThroughKernelTty, PosesComeWithTheirTime) {
  expect_poses_that_tell_the_time(cart().some<Birds>("poses", 150));
}

TEST_F(ThroughKernelTty, FramesComeWithKernelStampsAndPoses) {
  expect_a_frame_with_a_pose(cart());
  const auto frames = cart().some<VideoFrame>("frames", 25);
  ASSERT_EQ(frames.size(), 25U);
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const auto& info = frames[i].info;
    EXPECT_EQ(frames[i].rgb->size(), 320U * 180U * 3U);
    EXPECT_GT(info.sequence, frames[i - 1].info.sequence);
    EXPECT_GT(info.acquired, frames[i - 1].info.acquired);
    const double periods = (info.acquired - frames[0].info.acquired).seconds() * 25;
    EXPECT_NEAR(periods, static_cast<double>(info.sequence - frames[0].info.sequence), 3);
  }
}

TEST_F(ThroughKernelTty, ControlsAreNotHeldForAMachineThatIsNotPaired) {
  cart().lock_camera(true);
  const auto told = cart().next<wire::CameraControls>("word of the controls", [](const auto&) { return true; });
  ASSERT_TRUE(told);
  EXPECT_FALSE(told->locked);
  EXPECT_FALSE(told->refused.empty());
}

TEST_F(ThroughKernelTty, AnAdapterPulledOutIsMissedAndFoundAgainWhileFramesGoOn) {
  expect_the_adapter_missed_and_found(cart(), "ttyUSB0");
}

TEST_F(ThroughKernelTty, ACameraPulledOutIsMissedAndFoundAgainWhilePosesGoOn) {
  g_machine->must("unplug_vivid");
  EXPECT_TRUE(cart().next<Status>("word of the camera's loss",
                                  [](const Status& s) { return !s.ok && s.text.find("video0") != std::string::npos; }));
  EXPECT_EQ(cart().some<Birds>("poses", 50).size(), 50U);
  g_machine->must("plug_vivid");
  EXPECT_TRUE(cart().next<Status>("word of the camera's return", [](const Status& s) { return s.ok; }));
  EXPECT_EQ(cart().some<VideoFrame>("frames", 10).size(), 10U);
}

/// With pedal, LED and strobe, and frames from v4l2loopback, which does not say when they were taken: the strobe does.
/// Ten a second: an emulated processor hands frames on some 80 ms late, and a strobe is told from the next by a period.
class ThroughLibusb : public WithCart<ThroughLibusb> {
 public:
  static constexpr const char* kName = "libusb";
  static constexpr const char* kConfig = R"(
[tracker]
device = "usb:0403:6001:CART0001"
[camera]
source = "v4l2:/dev/video7"
width = 320
height = 180
rate_hz = 10
exposure_ms = 8
delay_ms = 10
[gpio]
chip = "cart"
strobe = "strobe"
pedal = "pedal"
led = "led"
trigger = "trigger"
trigger_rate_hz = 5
)";
  static void prepare() {
    g_machine->must("start camera " + testing::programs_folder() +
                    "/vm_instruments camera --v4l2 /dev/video7 --size 320x180 --rate 10 --format YUYV --exposure-ms 8 "
                    "--strobe $(gpio_line strobe)/pull --truth /run/out/camera.json && wait_for /run/out/camera.json");
  }
};

TEST_F(ThroughLibusb, TheKernelsDriverHasLetGo) {
  EXPECT_EQ(g_machine->must("basename $(readlink /sys/bus/usb/devices/1-1:1.0/driver)"), "usbfs");
}

TEST_F(ThroughLibusb, PosesComeWithTheirTime) {
  expect_poses_that_tell_the_time(cart().some<Birds>("poses", 150));
}

TEST_F(ThroughLibusb, DamageOnTheLineMakesNoWrongPose) {
  for (const char* const damage : {"parity", "framing", "overrun", "break"}) {
    g_machine->adapter().send(damage);
    // Each pose is looked at, and none is off the circle.
    expect_poses_that_tell_the_time(cart().some<Birds>("poses", 30));
  }
}

TEST_F(ThroughLibusb, AnAdapterPulledOutIsMissedAndFoundAgainWhileFramesGoOn) {
  expect_the_adapter_missed_and_found(cart(), "0403:6001");
}

TEST_F(ThroughLibusb, FramesComeFromTheLoopback) {
  const auto frames = cart().some<VideoFrame>("frames", 50);
  for (std::size_t i = 1; i < frames.size(); ++i) EXPECT_GT(frames[i].info.sequence, frames[i - 1].info.sequence);
}

/// Middle of exposure by the strobe's edges, against the simulated camera's own times. Coarsely so, for the simulator
/// pulls the line as late as an emulated processor wakes it; a time that an edge gave is known by its sigma.
TEST_F(ThroughLibusb, TheStrobeTellsWhenFramesWereTaken) {
  const auto truth = nlohmann::json::parse(g_machine->must("cat /run/out/camera.json"));
  const double period_s = 1 / truth.at("rate_hz").get<double>();
  const DeviceTime zero{truth.at("zero_monotonic_ns").get<std::int64_t>()};
  std::vector<double> off_ms;
  for (int seen = 0; seen < 600 && off_ms.size() < 10; ++seen) {
    const auto frame = cart().next<VideoFrame>("a frame", [](const VideoFrame&) { return true; });
    ASSERT_TRUE(frame);
    if (frame->info.acquired_sigma < kWakeSigma)
      off_ms.push_back(1e3 * std::abs(std::remainder((frame->info.acquired - zero).seconds(), period_s)));
  }
  ASSERT_EQ(off_ms.size(), 10U) << "frames are not paired with the strobe's edges";
  std::nth_element(off_ms.begin(), off_ms.begin() + static_cast<std::ptrdiff_t>(off_ms.size() / 2), off_ms.end());
  EXPECT_LT(off_ms[off_ms.size() / 2], 8);
}

/// Of the kernel's test driver, which this cart does not use; each is negotiated, streamed and converted.
TEST_F(ThroughLibusb, FormatsOfTheKernelAreTaken) {
  const std::string config =
      R"([tracker]\ndevice = "/dev/null"\n[camera]\nsource = "v4l2:/dev/video0"\nwidth = 320\nheight = 180\nrate_hz = 25\n)";
  for (const std::string format : {"YUYV", "UYVY", "NV12", "GREY"}) {
    g_machine->must("printf '" + config + "format = \"" + format + "\"\\n' > /run/format.toml");
    const std::string said =
        g_machine->must(testing::programs_folder() + "/birdseyed --config /run/format.toml --probe 2>&1 || true");
    EXPECT_NE(said.find("camera: /dev/video0"), std::string::npos) << said;
    EXPECT_NE(said.find(format), std::string::npos) << said;
    EXPECT_NE(said.find("320x180"), std::string::npos) << said;
  }
}

TEST_F(ThroughLibusb, ThePedalIsTold) {
  for (const bool pressed : {true, false, true, false}) {
    g_machine->must(pressed ? "gpio_drive pedal up" : "gpio_drive pedal down");
    const auto told = cart().next<wire::Pedal>("word of the pedal", [](const wire::Pedal&) { return true; });
    ASSERT_TRUE(told);
    EXPECT_EQ(told->pressed, pressed);
  }
}

TEST_F(ThroughLibusb, TheTriggerIsPulsed) {
  EXPECT_EQ(g_machine->must("gpio_seen trigger"), "0 1");
}

TEST_F(ThroughLibusb, TheLightIsSteadyWhileAllIsWellAndFlickersWhenItIsNot) {
  g_machine->must("until [ $(gpio_value led) = 1 ]; do sleep 0.1; done");
  EXPECT_EQ(g_machine->must("gpio_seen led"), "1");
  g_machine->adapter().send("unplug");
  (void)cart().next<Status>("word of the tracker's loss", [](const Status& s) { return !s.ok; });
  EXPECT_EQ(g_machine->must("gpio_seen led"), "0 1");
  g_machine->adapter().send("plug");
  (void)cart().next<Status>("word that all is well", [](const Status& s) { return s.ok; });
}

const auto* const kMachine = ::testing::AddGlobalTestEnvironment(new TheMachine);

}  // namespace
}  // namespace birdseye::vm
