// birdseyed as it was built, against the drivers of Debian's own kernel, in a virtual machine that is booted once for
// all of these tests (docs/manual/vm-test.md). They look at it from outside: at its wire, and at the world around it.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

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

void expect_poses_that_tell_the_time(const std::vector<Birds>& all) {
  for (std::size_t i = 1; i < all.size(); ++i) {
    const double passed_s = (all[i].acquired - all[0].acquired).seconds();
    const double late_s = std::remainder(passed_s - (angle_of(all[i]) - angle_of(all[0])) / std::numbers::pi, 2.0);
    EXPECT_LT(std::abs(late_s), 0.03) << "measurement " << i;
  }
}

template <typename Self>
class WithCart : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (g_machine->up()) cart_ = std::make_unique<Cart>(*g_machine, Self::kName, Self::kConfig);
  }
  static void TearDownTestSuite() { cart_.reset(); }
  void SetUp() override {
    if (!g_machine->up()) GTEST_FAIL() << "no virtual machine";
  }
  static Cart& cart() { return *cart_; }

 private:
  static inline std::unique_ptr<Cart> cart_;
};

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

TEST_F(ThroughKernelTty, PosesComeWithTheirTime) {
  const auto birds = cart().some<Birds>("poses", 150);
  ASSERT_EQ(birds.size(), 150U);
  expect_poses_that_tell_the_time(birds);
}

TEST_F(ThroughKernelTty, FramesComeWithKernelStampsAndPoses) {
  (void)cart().next<VideoFrame>("frame with a pose",
                                [](const VideoFrame& f) { return f.info.pose.kind == PoseKind::interpolated; });
  const auto frames = cart().some<VideoFrame>("frames", 25);
  ASSERT_EQ(frames.size(), 25U);
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const auto& info = frames[i].info;
    EXPECT_EQ(frames[i].rgb->size(), 320U * 180U * 3U);
    EXPECT_GT(info.sequence, frames[i - 1].info.sequence);
    // vivid's stamps are of the pictures' own time, not of when it got round to making them.
    const double periods = (info.acquired - frames[0].info.acquired).seconds() * 25;
    EXPECT_NEAR(periods, static_cast<double>(info.sequence - frames[0].info.sequence), 0.5);
  }
}

TEST_F(ThroughKernelTty, AnAdapterPulledOutIsMissedAndFoundAgainWhileFramesGoOn) {
  g_machine->adapter().send("unplug");
  EXPECT_TRUE(cart().next<Status>("word of the tracker's loss", [](const Status& s) {
    return !s.ok && s.text.find("ttyUSB0") != std::string::npos;
  }));
  EXPECT_EQ(cart().some<VideoFrame>("frames", 10).size(), 10U);
  g_machine->adapter().send("plug");
  EXPECT_TRUE(cart().next<Status>("word of the tracker's return", [](const Status& s) { return s.ok; }));
  expect_poses_that_tell_the_time(cart().some<Birds>("poses", 20));
}

TEST_F(ThroughKernelTty, ACameraPulledOutIsMissedAndFoundAgainWhilePosesGoOn) {
  // vivid fails every call from now on; its node goes and returns once nobody holds it.
  g_machine->must("v4l2-ctl -d /dev/video0 -c disconnect=1");
  EXPECT_TRUE(cart().next<Status>("word of the camera's loss",
                                  [](const Status& s) { return !s.ok && s.text.find("video0") != std::string::npos; }));
  g_machine->must("until modprobe -r vivid; do sleep 0.1; done");
  EXPECT_EQ(cart().some<Birds>("poses", 50).size(), 50U);
  g_machine->must("start_vivid");
  EXPECT_TRUE(cart().next<Status>("word of the camera's return", [](const Status& s) { return s.ok; }));
  EXPECT_EQ(cart().some<VideoFrame>("frames", 10).size(), 10U);
}

const auto* const kMachine = ::testing::AddGlobalTestEnvironment(new TheMachine);

}  // namespace
}  // namespace birdseye::vm
