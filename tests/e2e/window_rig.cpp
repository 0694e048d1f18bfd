#include "tests/e2e/window_rig.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <sys/socket.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <sstream>

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "drivers/system/local_programs.hpp"
#include "drivers/system/wait.hpp"
#include "host/operation/operation.hpp"
#include "host/overlay/ct_sha256.hpp"
#include "host/volume/import.hpp"
#include "hw-sim/minibird/motion.hpp"
#include "tests/support/programs_folder.hpp"
#include "tests/support/slicer.hpp"
#include "tests/support/small_ct.hpp"
#include "tests/support/this_machine.hpp"

namespace birdseye::testing {

namespace {

constexpr int kVideoWidth = 320, kVideoHeight = 240, kWindowWidth = 1280, kWindowHeight = 720;
// Where the window has the video (host/window/live_panels.cpp): right of the workflow, above the strip.
constexpr double kSidePx = 330, kStripPx = 62;
constexpr double kZoom = (kWindowHeight - kStripPx) / kVideoHeight;
constexpr double kLeftPx = kSidePx + (kWindowWidth - kSidePx - kZoom * kVideoWidth) / 2;
// What is looked at: below the line over the video, above the small picture of the CT.
constexpr int kTopPx = 30, kHighPx = 412;
constexpr int kFromPx = 366, kWidePx = 877;
constexpr double kFocalPx = 300;
// 20 mm beside the middle of the scope's circle, and a little above its plane.
const Eigen::Vector3d kBallInTracker_mm(420, 0, 10);

CameraModel camera() {
  CameraModel out;
  out.width_px = kVideoWidth;
  out.height_px = kVideoHeight;
  out.fx_px = out.fy_px = kFocalPx;
  out.cx_px = (kVideoWidth - 1) / 2.0;
  out.cy_px = (kVideoHeight - 1) / 2.0;
  return out;
}

/// The scope looks along -x of its sensor: to the middle of the circle.
Transform<Camera, Sensor> camera_from_sensor() {
  Eigen::Matrix3d axes;
  axes << 0, 1, 0, 0, 0, -1, -1, 0, 0;
  return {axes, Eigen::Vector3d::Zero()};
}

/// Where the ball's middle truly is, camera frame.
Eigen::Vector3d ball_in_camera_mm(double circle_s) {
  const hw_sim::BirdPose pose = hw_sim::Circle{}.pose(0, circle_s);
  const Transform<Tracker, Sensor> tracker_from_sensor(pose.rotation, pose.position_mm);
  return camera_from_sensor() * tracker_from_sensor.inverse() * kBallInTracker_mm;
}

/// A tip in the scope's sensor that goes about the middle of the circle, 20 mm away from it.
constexpr const char* kTipInSensor_mm = "-180 0 0\n";

/// The ball, and places all along the way of that tip, in the patient's frame.
std::string landmarks_on_its_way() {
  constexpr int kPlaces = 16;
  constexpr double kRadius_mm = 20;
  std::string text = "name,x,y,z\nball,0,0,0\n";
  const Eigen::Vector3d middle_mm = hw_sim::Circle{}.centre_mm - kBallInTracker_mm;
  for (int i = 0; i < kPlaces; ++i) {
    const double angle_rad = 2 * M_PI * i / kPlaces;
    text += fmt::format("place {},{:.3f},{:.3f},{:.3f}\n", i, middle_mm.x() + kRadius_mm * std::cos(angle_rad),
                        middle_mm.y() + kRadius_mm * std::sin(angle_rad), middle_mm.z());
  }
  return text;
}

void write_registered(const std::filesystem::path& folder, const std::string& ct) {
  const auto volume = host::import_volume(ct);
  ASSERT_TRUE(volume) << volume.error().what;
  host::Operation operation;
  operation.made_utc = "2026-11-22T09:30:00Z";
  operation.ct_sha256 = host::ct_sha256(*volume);
  calibration::HandEyeResult hand_eye;
  hand_eye.camera_from_sensor = camera_from_sensor();
  hand_eye.held_out_px = 1;
  hand_eye.held_out_mm = 0.5;
  operation.calibrated = {host::ScopeSetup::of_hand_eye(camera(), 0.3, hand_eye), operation.made_utc, true};
  operation.registered = {Transform<Tracker, Patient>(Eigen::Matrix3d::Identity(), kBallInTracker_mm),
                          0.2,
                          {{10, 0, 0}, {-10, 0, 0}, {0, 10, 0}, {0, 0, 10}}};
  std::filesystem::create_directories(folder);
  const auto written = host::write_operation(folder, operation, *testing::authors().machine);
  ASSERT_TRUE(written) << written.error().what;
}

bool listens(int port, Deadline deadline) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  for (bool there = false; !deadline.passed();) {
    const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
    there = ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    ::close(fd);
    if (there) return true;
    sleep_for(Duration::from_ms(50));
  }
  return false;
}

/// The frame's number, and whether the picture is dimmed; what is at the places of a block's middle decides.
struct Number {
  std::optional<std::uint32_t> value;
  int white = 0;
};

Number number_in(const std::vector<std::uint8_t>& rgb, int width_px) {
  constexpr int kRow = 34 - kTopPx;
  const int block = width_px / 32 / 2 * 2;
  const double zoom = kZoom * kVideoWidth / width_px;
  Number out;
  std::uint32_t value = 0;
  for (int i = 0; i < 32; ++i) {
    const int x = static_cast<int>(kLeftPx + (i + 0.5) * block * zoom) - kFromPx;
    const int level = rgb[3 * static_cast<std::size_t>(kRow * kWidePx + x)];
    const bool black = level < 40;
    const bool white = level > 230;
    const bool dimmed_white = level > 110 && level < 145;
    if (!black && !white && !dimmed_white) return {};
    value = 2 * value + (black ? 0U : 1U);
    out.white = std::max(out.white, level);
  }
  out.value = value;
  return out;
}

}  // namespace

/// A client of the window's own, and what it was told.
struct WindowRig::Hearing {
  explicit Hearing(int port) : slicer(port), thread([this](const std::stop_token& stop) { listen(stop); }) {}
  void listen(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      if (!slicer.receive() && !slicer.connected()) return;
      const std::lock_guard lock(mutex);
      if (slicer.counts["STATUS"] != heard["STATUS"])
        said.push_back({monotonic_ns(), slicer.status_ok ? "" : slicer.status});
      heard = slicer.counts;
    }
  }
  Slicer slicer;
  std::mutex mutex;
  std::vector<Said> said;
  std::map<std::string, int> heard;
  std::jthread thread;
};

CoreWatch::CoreWatch() {
  for (int core = 0; core < static_cast<int>(std::thread::hardware_concurrency()); ++core)
    threads_.emplace_back([this, core](const std::stop_token& stop) { watch(core, stop); });
}

void CoreWatch::watch(int core, const std::stop_token& stop) {
  constexpr std::int64_t kNapNs = 5'000'000, kLateNs = 40'000'000;
  cpu_set_t only;
  CPU_ZERO(&only);
  CPU_SET(static_cast<std::size_t>(core), &only);
  ::pthread_setaffinity_np(::pthread_self(), sizeof only, &only);
  while (!stop.stop_requested()) {
    const std::int64_t before_ns = monotonic_ns();
    sleep_for(Duration{kNapNs});
    const std::int64_t now_ns = monotonic_ns();
    if (now_ns - before_ns < kLateNs) continue;
    const std::lock_guard lock(mutex_);
    late_ns_.push_back(now_ns);
  }
}

bool CoreWatch::stood_still(std::int64_t from_ns, std::int64_t until_ns) const {
  constexpr std::int64_t kBesideNs = 300'000'000;
  const std::lock_guard lock(mutex_);
  return std::any_of(late_ns_.begin(), late_ns_.end(), [&](std::int64_t late_ns) {
    return late_ns > from_ns - kBesideNs && late_ns < until_ns + kBesideNs;
  });
}

WindowRig::WindowRig(const Scratch& scratch, const std::string& tracker_faults, const std::string& camera_faults)
    : display_(fmt::format("{}x{}", kWindowWidth, kWindowHeight)) {
  screen_ = std::make_unique<Screen>(display_.name());
  const std::string ct = small_ct(scratch);
  write_registered(scratch / "operation", ct);
  FaultRig::Settings settings{.folder = scratch / "cart"};
  settings.tracker_faults = tracker_faults;
  settings.camera_faults = camera_faults;
  settings.size = fmt::format("{}x{}", kVideoWidth, kVideoHeight);
  settings.format = "GREY";  // so that whatever has a colour is the overlay
  appliance_ = std::make_unique<FaultRig>(settings);
  listening_ = std::jthread(
      [this](const std::stop_token& stop) { appliance_->listen(3600, [&] { return stop.stop_requested(); }); });
  const std::string fiducials = scratch.file("fiducials.txt", "10 0 0\n-10 0 0\n0 10 0\n0 0 10\n");
  const std::string magenta = scratch.file("magenta.json",
                                           R"({"points": [{"hu": -500, "rgb": [1, 0, 1], "extinction_per_mm": 0},
                       {"hu": 0, "rgb": [1, 0, 1], "extinction_per_mm": 5}]})");
  // The scope's own bird stands for the pointer: wherever the tip is there is a landmark, so that somebody may say that
  // the registration holds.
  const std::string tip = scratch.file("tip.txt", kTipInSensor_mm);
  const std::string landmarks = scratch.file("landmarks.csv", landmarks_on_its_way());
  // The operation does not say with which instruments it was found: a person says that they are these. The pattern of
  // the camera does not move as the scope does, which a check of its motion would see.
  const std::string script = scratch.file("script.txt",
                                          "wait connect 30\nsleep 3\nkey space\nsleep 1.2\nkey 6\nkey space\nsleep "
                                          "1.2\nkey space\nsleep 0.9\nkey space\nwait run 5\nsleep 3600\nend\n");
  const int port = *free_port();
  std::vector<std::string> words;
  std::istringstream in(fmt::format(
      "{} {}/birdseye live --server 127.0.0.1:{} --ct {} --fiducials {} --fiducial-count 4 --transfer {} --resume {} "
      "--out {} --script {} --publish {} --size {}x{} --scale 1 --no-motion-check --pointer scope --tip {} --landmarks "
      "{}",
      display_.env(), testing::programs_folder(), appliance_->port(), ct, fiducials, magenta,
      (scratch / "operation").string(), (scratch / "out").string(), script, port, kWindowWidth, kWindowHeight, tip,
      landmarks));
  for (std::string word; in >> word;) words.push_back(word);
  first_frame_ns_ = appliance_->first_frame_ns();
  window_ = std::make_unique<Child>(words);
  EXPECT_TRUE(listens(port, Deadline::after(Duration::from_ms(20'000)))) << failure();
  hearing_ = std::make_unique<Hearing>(port);
}

WindowRig::~WindowRig() {
  listening_.request_stop();
  if (hearing_) hearing_->thread.request_stop();
}

Glance WindowRig::look() {
  Glance out;
  out.at_ns = monotonic_ns();
  const std::vector<std::uint8_t> rgb = screen_->grab(kFromPx, kTopPx, kWidePx, kHighPx);
  if (rgb.empty()) return out;
  for (const int width_px : {kVideoWidth, kVideoWidth / 2}) {
    const Number number = number_in(rgb, width_px);
    if (!number.value || *number.value == 0) continue;
    // A number that is read by the wrong size is of a wrong time.
    const double age_s = static_cast<double>(out.at_ns - exposed_ns(*number.value)) * 1e-9;
    if (age_s < -1 || age_s > 60) continue;
    out.exposure = number.value;
    out.dimmed = number.white < 200;
    break;
  }
  double sum_x = 0, sum_y = 0;
  for (int y = 0; y < kHighPx; ++y) {
    for (int x = 0; x < kWidePx; ++x) {
      const std::uint8_t* const at = rgb.data() + 3 * static_cast<std::size_t>(y * kWidePx + x);
      if (at[0] - at[1] < 24 || at[2] - at[1] < 24) continue;
      ++out.overlaid_px;
      sum_x += x;
      sum_y += y;
    }
  }
  constexpr double kFew = 20;
  if (out.overlaid_px < kFew || !out.exposure) return out;
  const double circle_s = static_cast<double>(exposed_ns(*out.exposure) - circle_zero_ns_) * 1e-9;
  const Eigen::Vector3d ball_mm = ball_in_camera_mm(circle_s);
  const Eigen::Vector2d want_px =
      kFocalPx * ball_mm.head<2>() / ball_mm.z() + Eigen::Vector2d(camera().cx_px, camera().cy_px);
  const Eigen::Vector2d got_px((kFromPx + sum_x / out.overlaid_px + 0.5 - kLeftPx) / kZoom - 0.5,
                               (kTopPx + sum_y / out.overlaid_px + 0.5) / kZoom - 0.5);
  out.off_mm = (got_px - want_px).norm() * ball_mm.z() / kFocalPx;
  return out;
}

void WindowRig::watch(double seconds) {
  circle_zero_ns_ = appliance_->circle_zero_ns();
  EXPECT_GT(first_frame_ns_, 0);
  EXPECT_GT(circle_zero_ns_, 0);
  const std::int64_t end_ns = monotonic_ns() + static_cast<std::int64_t>(seconds * 1e9);
  while (monotonic_ns() < end_ns) {
    glances_.push_back(look());
    sleep_for(Duration::from_ms(8));
  }
}

bool WindowRig::shows_overlay_within(double seconds) {
  const std::int64_t end_ns = monotonic_ns() + static_cast<std::int64_t>(seconds * 1e9);
  while (monotonic_ns() < end_ns) {
    if (look().overlaid_px > 0) return true;
    sleep_for(Duration::from_ms(50));
  }
  return false;
}

std::vector<Said> WindowRig::said() {
  const std::lock_guard lock(hearing_->mutex);
  return hearing_->said;
}

int WindowRig::sent(const std::string& type) {
  const std::lock_guard lock(hearing_->mutex);
  return hearing_->heard[type];
}

std::int64_t WindowRig::exposed_ns(std::uint32_t number) const {
  return first_frame_ns_ + static_cast<std::int64_t>(number / FaultRig::kFrameRateHz * 1e9);
}

std::string WindowRig::failure() {
  window_->catch_up();
  return appliance_->failure() + window_->output();
}

int WindowRig::end() {
  window_->signal(SIGINT);
  return window_->exit_code(Deadline::after(Duration::from_ms(20'000)));
}

}  // namespace birdseye::testing
