#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <latch>
#include <thread>

#include "drivers/system/clock.hpp"
#include "drivers/system/unique_fd.hpp"
#include "drivers/video/frame_source.hpp"
#include "drivers/video/pixel_format.hpp"
#include "drivers/video/pixel_pool.hpp"
#include "tests/drivers/video/jpeg_pictures.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::drivers {
namespace {

/// A program that listens at a socket and sends what it is given, in two halves with a pause between them.
class Sender {
 public:
  explicit Sender(const std::vector<std::uint8_t>& bytes, bool in_two = false)
      : path_(std::filesystem::temp_directory_path() / ("birdseye-test-" + std::to_string(::getpid()))) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path_.c_str(), sizeof address.sun_path - 1);
    ::unlink(path_.c_str());
    fd_ = ::socket(AF_UNIX, SOCK_STREAM, 0);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(fd_, 1), 0);
    if (!in_two) rest_.count_down();
    thread_ = std::jthread([this, bytes] {
      const int client = ::accept(fd_, nullptr, nullptr);
      const std::size_t half = bytes.size() / 2;
      (void)!::write(client, bytes.data(), half);
      rest_.wait();
      (void)!::write(client, bytes.data() + half, bytes.size() - half);
      ::close(client);
    });
  }
  ~Sender() {
    thread_.join();
    ::close(fd_);
    ::unlink(path_.c_str());
  }
  /// Of bytes in two: sends the second half.
  void send_rest() { rest_.count_down(); }
  [[nodiscard]] CameraSettings settings() const { return {"socket:" + path_.string(), 4, 2, 25}; }

 private:
  std::filesystem::path path_;
  int fd_;
  std::latch rest_{1};
  std::jthread thread_;
};

template <typename T>
void put(std::vector<std::uint8_t>& bytes, std::size_t offset, T value) {
  std::memcpy(bytes.data() + offset, &value, sizeof value);
}

std::vector<std::uint8_t> message_of(const char* format, std::uint32_t width, std::uint32_t height,
                                     const std::vector<std::uint8_t>& payload, std::uint64_t sequence = 9) {
  std::vector<std::uint8_t> bytes(64 + payload.size());
  std::memcpy(bytes.data(), "BEFRAME1", 8);
  put(bytes, 8, width);
  put(bytes, 12, height);
  std::memcpy(bytes.data() + 16, format, 4);
  put(bytes, 24, sequence);
  put(bytes, 32, std::int64_t{77});
  put(bytes, 40, std::int64_t{5});
  put(bytes, 48, std::uint64_t{payload.size()});
  std::copy(payload.begin(), payload.end(), bytes.begin() + 64);
  return bytes;
}

std::vector<std::uint8_t> message() {
  std::vector<std::uint8_t> payload;
  for (std::uint8_t i = 0; i < 24; ++i) payload.push_back(i);
  return message_of("RGB3", 4, 2, payload);
}

DeviceTime soon() {
  return device_now() + Duration::from_ms(5000);
}

TEST(SocketCamera, GivesAFrameEvenWhenADeadlineCutsIt) {
  Sender sender(message(), true);
  const auto camera = open_camera(sender.settings());
  ASSERT_TRUE(camera) << camera.error().what;
  const auto early = (*camera)->next(device_now() + Duration::from_ms(20));
  ASSERT_TRUE(early);
  EXPECT_FALSE(*early);
  sender.send_rest();
  const auto frame = (*camera)->next(soon());
  ASSERT_TRUE(frame && *frame);
  EXPECT_EQ((*frame)->sequence, 9U);
  EXPECT_TRUE((*frame)->acquired_known);
  EXPECT_EQ((*frame)->acquired.ns, 77);
  EXPECT_EQ((*frame)->acquired_sigma.ns, 5);
  EXPECT_EQ((*frame)->width_px, 4);
  EXPECT_EQ((*(*frame)->rgb)[23], 23);
  EXPECT_EQ((*camera)->next(soon()).error().code, Errc::disconnected);
}

TEST(SocketCamera, AProgramThatTakesNobodyInIsSaidAtOnce) {
  const testing::Scratch scratch;
  const std::string path = (scratch / "camera").string();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  const UniqueFd listener(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  ASSERT_EQ(::bind(listener.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(::listen(listener.get(), 0), 0);
  std::vector<std::unique_ptr<FrameSource>> waiting;
  for (;;) {
    auto camera = open_camera({.source = "socket:" + path});
    if (!camera) {
      EXPECT_NE(camera.error().what.find("takes nobody in"), std::string::npos) << camera.error().what;
      break;
    }
    waiting.push_back(*std::move(camera));
    ASSERT_LT(waiting.size(), 10U);
  }
}

TEST(SocketCamera, RefusesWhatIsNoFrame) {
  const auto refuses = [](std::size_t offset, auto value) {
    auto bytes = message();
    put(bytes, offset, value);
    const Sender sender(bytes);
    const auto camera = open_camera(sender.settings());
    ASSERT_TRUE(camera);
    const auto frame = (*camera)->next(soon());
    ASSERT_FALSE(frame) << "at " << offset;
    EXPECT_EQ(frame.error().code, Errc::bad_format) << "at " << offset;
  };
  refuses(0, 'X');
  refuses(8, std::uint32_t{0});
  refuses(8, std::uint32_t{0x8000'0004});
  refuses(12, std::uint32_t{8193});
  refuses(16, 'X');
  refuses(24, std::uint64_t{0x7fff'ffff'ffff'ffff});
  refuses(32, std::int64_t{-1});
  refuses(32, std::int64_t{0x7fff'ffff'ffff'ffff});
  refuses(40, std::int64_t{-5});
  refuses(48, std::uint64_t{25});
  refuses(48, std::uint64_t{0xffff'ffff'ffff'ffff});
}

TEST(SocketCamera, AFrameWithoutATimeHasNone) {
  auto bytes = message();
  put(bytes, 32, std::int64_t{0});
  put(bytes, 40, std::int64_t{0});
  const Sender sender(bytes);
  const auto camera = open_camera(sender.settings());
  ASSERT_TRUE(camera);
  const auto frame = (*camera)->next(soon());
  ASSERT_TRUE(frame && *frame);
  EXPECT_FALSE((*frame)->acquired_known);
  EXPECT_GT((*frame)->arrived.ns, 0);
}

TEST(SocketCamera, TakesEveryFormat) {
  for (const char* format : {"BGR3", "YUYV", "UYVY", "NV12", "GREY"}) {
    const PixelLayout layout = packed_layout(*pixel_format_of_name(format), 5, 3);
    std::vector<std::uint8_t> payload(bytes_needed(layout));
    for (std::size_t i = 0; i < payload.size(); ++i) payload[i] = static_cast<std::uint8_t>(40 + 7 * i);
    const Sender sender(message_of(format, 5, 3, payload));
    const auto camera = open_camera(sender.settings());
    ASSERT_TRUE(camera);
    const auto frame = (*camera)->next(soon());
    ASSERT_TRUE(frame && *frame) << format;
    std::vector<std::uint8_t> right;
    to_rgb(payload, layout, right);
    EXPECT_EQ(*(*frame)->rgb, right) << format;
    EXPECT_NE((*camera)->describe().find(std::string(format) + " 5x3"), std::string::npos) << (*camera)->describe();
  }
}

TEST(SocketCamera, DropsADamagedJpegAndCountsHoles) {
  const auto whole = test::encode_jpeg(test::smooth_picture(32, 16), 32, 16);
  const std::vector<std::uint8_t> cut(whole.begin(), whole.begin() + static_cast<long>(whole.size()) - 40);
  std::vector<std::uint8_t> bytes = message_of("MJPG", 32, 16, whole, 1);
  for (const auto& [payload, sequence] : {std::pair(cut, 2U), std::pair(whole, 6U), std::pair(whole, 1U)}) {
    const auto next = message_of("MJPG", 32, 16, payload, sequence);
    bytes.insert(bytes.end(), next.begin(), next.end());
  }
  const Sender sender(bytes);
  const auto camera = open_camera(sender.settings());
  ASSERT_TRUE(camera);
  for (const std::uint64_t sequence : {1U, 2U, 6U, 1U}) {  // the last from a sender that began anew
    const auto frame = (*camera)->next(soon());
    ASSERT_TRUE(frame);
    ASSERT_EQ(frame->has_value(), sequence != 2) << "whoever reads it knows that one came, and may wait for the next";
    if (sequence == 2) continue;
    EXPECT_EQ((*frame)->sequence, sequence);
    EXPECT_EQ((*frame)->rgb->size(), 32U * 16 * 3);
  }
  EXPECT_EQ((*camera)->counters().frames, 3U);
  EXPECT_EQ((*camera)->counters().incomplete, 1U);
  EXPECT_EQ((*camera)->counters().gaps, 3U);
}

TEST(PixelPool, ABufferComesBackWhenItsLastReaderLetsGo) {
  PixelPool pool;
  auto pixels = pool.take();
  pixels->assign(1000, 1);
  const PixelPool::Pixels* const first = pixels.get();
  auto frame = pool.share(std::move(pixels));
  auto reader = frame;
  frame.reset();
  const auto other = pool.take();
  EXPECT_NE(other.get(), first);
  reader.reset();
  EXPECT_EQ(pool.take().get(), first);
}

TEST(PixelPool, MayGoBeforeItsReaders) {
  std::shared_ptr<const PixelPool::Pixels> frame;
  {
    PixelPool pool;
    auto pixels = pool.take();
    pixels->assign(1000, 7);
    frame = pool.share(std::move(pixels));
  }
  EXPECT_EQ(frame->at(999), 7);
}

TEST(Camera, UnknownAndMissingSourcesAreNamed) {
  EXPECT_NE(open_camera({"webcam", 4, 2, 25}).error().what.find("webcam"), std::string::npos);
  EXPECT_EQ(open_camera({"socket:/nonexistent", 4, 2, 25}).error().code, Errc::not_found);
  EXPECT_EQ(open_camera({"v4l2:/nonexistent", 4, 2, 25}).error().code, Errc::not_found);
}

}  // namespace
}  // namespace birdseye::drivers
