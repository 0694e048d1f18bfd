#include "device/birdseyed/camera_thread.hpp"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <atomic>
#include <cstring>
#include <optional>
#include <thread>

#include "device/birdseyed/event_queue.hpp"
#include "device/birdseyed/instrument_thread.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/unique_fd.hpp"
#include "drivers/system/wait.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::device {
namespace {

/// A program that sends frames of 4 x 2 pixels at a socket, 100 a second, to one after the other who connects.
class Program {
 public:
  explicit Program(const std::string& path) : listener_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(listener_.get(), 1), 0);
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        pollfd entry{listener_.get(), POLLIN, 0};
        if (::poll(&entry, 1, 20) <= 0) continue;
        const UniqueFd client(::accept(listener_.get(), nullptr, nullptr));
        while (!stop.stop_requested() && send(client.get())) {
          if (!floods) sleep_for(Duration::from_ms(10));
        }
      }
    });
  }
  std::atomic<bool> sticks = false;  ///< the same frame over and over
  std::atomic<bool> floods = false;  ///< as fast as the socket takes them
  /// Of so many frames all but one are damaged.
  static constexpr int kOneWholeOf = 50;
  std::atomic<bool> damages = false;

 private:
  bool send(int client) {
    if (!sticks) ++sequence_;
    std::array<std::uint8_t, 64 + 24> bytes{};
    const std::uint32_t width = 4, height = 2;
    const std::uint64_t payload = 24;
    const std::int64_t acquired_ns = 1 + static_cast<std::int64_t>(sequence_), sigma_ns = 1000;
    std::memcpy(bytes.data(), "BEFRAME1", 8);
    std::memcpy(bytes.data() + 8, &width, sizeof width);
    std::memcpy(bytes.data() + 12, &height, sizeof height);
    std::memcpy(bytes.data() + 16, damages && sequence_ % kOneWholeOf != 0 ? "MJPG" : "RGB3", 4);
    std::memcpy(bytes.data() + 24, &sequence_, sizeof sequence_);
    std::memcpy(bytes.data() + 32, &acquired_ns, sizeof acquired_ns);
    std::memcpy(bytes.data() + 40, &sigma_ns, sizeof sigma_ns);
    std::memcpy(bytes.data() + 48, &payload, sizeof payload);
    return ::send(client, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }

  UniqueFd listener_;
  std::uint64_t sequence_ = 0;
  std::jthread thread_;
};

class ACamera : public ::testing::Test {
 protected:
  ACamera() : program_((scratch_ / "camera").string()) {
    thread_ = std::jthread([this](const std::stop_token& stop) {
      run_camera({.source = "socket:" + (scratch_ / "camera").string(), .width_px = 4, .height_px = 2, .rate_hz = 100},
                 drivers::open_camera, post_, lock_, stop);
    });
  }
  /// The text of the next change to that state, and whether a frame came before it.
  std::pair<std::string, bool> next(InstrumentState state) {
    bool frame = false;
    for (const DeviceTime until = device_now() + Duration::from_ms(20'000); device_now() < until;) {
      const auto event = queue_.pop(until, {});
      if (!event) break;
      frame = frame || std::holds_alternative<FrameCame>(*event);
      const auto* const changed = std::get_if<InstrumentChanged>(&*event);
      if (changed != nullptr && changed->state == state) return {changed->text, frame};
    }
    ADD_FAILURE() << "the state did not come";
    return {};
  }

  /// From the first to the last of so many frames whose number is a multiple. What the queue dropped came in between,
  /// and only makes it longer.
  double between_frames_s(int frames, std::uint64_t multiple) {
    std::optional<DeviceTime> first, last;
    for (int came = 0; came < frames;) {
      const auto event = queue_.pop(device_now() + Duration::from_ms(20'000), {});
      if (!event) {
        ADD_FAILURE() << "the frames did not come";
        return 0;
      }
      const auto* const frame = std::get_if<FrameCame>(&*event);
      if (frame == nullptr || frame->frame.sequence % multiple != 0) continue;
      ++came;
      if (!first) first = frame->frame.arrived;
      last = frame->frame.arrived;
    }
    return (*last - *first).seconds();
  }
  static constexpr int kAtOnce = 9;  ///< are read after a halt, whatever the rate

  testing::Scratch scratch_;
  Program program_;
  std::atomic<bool> lock_wanted_ = false;
  std::atomic<int> locked_ = 0, unlocked_ = 0;
  ControlsLock lock_{[this] { return lock_wanted_.load(); },
                     [this](bool locked, const drivers::ControlReport&) { ++(locked ? locked_ : unlocked_); }};
  EventQueue queue_;
  InstrumentPost post_{Instrument::camera, queue_};
  std::jthread thread_;
};

TEST_F(ACamera, RunsFromItsFirstFrameOn) {
  const auto [text, frame] = next(InstrumentState::running);
  EXPECT_FALSE(frame);
  EXPECT_NE(text.find("4x2"), std::string::npos) << text;
}

TEST_F(ACamera, ThatRepeatsAFrameIsSilent) {
  next(InstrumentState::running);
  program_.sticks = true;
  const auto [text, frame] = next(InstrumentState::silent);
  EXPECT_TRUE(frame);
  EXPECT_NE(text.find("sends no new frames"), std::string::npos) << text;
  program_.sticks = false;
  next(InstrumentState::running);
}

TEST_F(ACamera, ThatSendsAsFastAsItCanIsReadAtFourTimesItsRate) {
  program_.floods = true;
  next(InstrumentState::running);
  constexpr int kFrames = 100;
  EXPECT_GE(between_frames_s(kFrames, 1), (kFrames - 1 - kAtOnce) / 400.0);
}

/// They cost as much to read as whole ones.
TEST_F(ACamera, ThatSendsDamagedFramesAsFastAsItCanIsReadNoFaster) {
  program_.damages = true;
  program_.floods = true;
  next(InstrumentState::running);
  constexpr int kWhole = 4, kOneOf = Program::kOneWholeOf;
  EXPECT_GE(between_frames_s(kWhole, kOneOf), ((kWhole - 1) * kOneOf - kAtOnce) / 400.0);
}

TEST_F(ACamera, IsHeldOnceAndLetGoOnceAsIsWanted) {
  next(InstrumentState::running);
  lock_wanted_ = true;
  EXPECT_NE(next(InstrumentState::running).first.find("controls held"), std::string::npos);
  lock_wanted_ = false;
  EXPECT_EQ(next(InstrumentState::running).first.find("controls held"), std::string::npos);
  EXPECT_EQ(locked_, 1);
  EXPECT_EQ(unlocked_, 1);
}

}  // namespace
}  // namespace birdseye::device
