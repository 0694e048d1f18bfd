#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <thread>

#include "drivers/io/monotonic.hpp"
#include "drivers/video/frame_source.hpp"
#include "drivers/video/pixel_format.hpp"

namespace birdseye::drivers {
namespace {

TEST(PixelFormat, ConvertsToRgb) {
  const std::vector<std::uint8_t> bgr{1, 2, 3, 4, 5, 6};
  EXPECT_EQ(to_rgb(bgr, PixelFormat::bgr8, 2, 1, 6), (std::vector<std::uint8_t>{3, 2, 1, 6, 5, 4}));
  const std::vector<std::uint8_t> grey{7, 8, 99, 9, 10, 99};  // a stride of three
  EXPECT_EQ(to_rgb(grey, PixelFormat::grey8, 2, 2, 3),
            (std::vector<std::uint8_t>{7, 7, 7, 8, 8, 8, 9, 9, 9, 10, 10, 10}));
}

TEST(PixelFormat, YuyvIsLimitedRangeBt601) {
  // Black, white, and pure red (81, 90, 240), as the recommendation tables them.
  const std::vector<std::uint8_t> yuyv{16, 128, 235, 128, 81, 90, 81, 240};
  const auto rgb = to_rgb(yuyv, PixelFormat::yuyv, 4, 1, 8);
  EXPECT_EQ(rgb[0], 0);
  EXPECT_EQ(rgb[3], 255);
  EXPECT_NEAR(rgb[6], 254, 2);
  EXPECT_NEAR(rgb[7], 0, 2);
  EXPECT_NEAR(rgb[8], 0, 2);
}

/// A program that listens at a socket and sends what it is given, in two halves with a pause between them.
class Sender {
 public:
  explicit Sender(const std::vector<std::uint8_t>& bytes)
      : path_(std::filesystem::temp_directory_path() / ("birdseye-test-" + std::to_string(::getpid()))) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path_.c_str(), sizeof address.sun_path - 1);
    ::unlink(path_.c_str());
    fd_ = ::socket(AF_UNIX, SOCK_STREAM, 0);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(fd_, 1), 0);
    thread_ = std::jthread([this, bytes] {
      const int client = ::accept(fd_, nullptr, nullptr);
      const std::size_t half = bytes.size() / 2;
      (void)!::write(client, bytes.data(), half);
      sleep_for(Duration::from_ms(60));
      (void)!::write(client, bytes.data() + half, bytes.size() - half);
      ::close(client);
    });
  }
  ~Sender() {
    thread_.join();
    ::close(fd_);
    ::unlink(path_.c_str());
  }
  [[nodiscard]] CameraSettings settings() const { return {"socket:" + path_.string(), 4, 2, 25}; }

 private:
  std::filesystem::path path_;
  int fd_;
  std::jthread thread_;
};

std::vector<std::uint8_t> message() {
  std::vector<std::uint8_t> bytes(64 + 24);
  std::memcpy(bytes.data(), "BEFRAME1", 8);
  bytes[8] = 4;
  bytes[12] = 2;
  std::memcpy(bytes.data() + 16, "RGB3", 4);
  bytes[24] = 9;
  bytes[32] = 77;
  bytes[40] = 5;
  bytes[48] = 24;
  for (std::size_t i = 0; i < 24; ++i) bytes[64 + i] = static_cast<std::uint8_t>(i);
  return bytes;
}

TEST(SocketCamera, GivesAFrameEvenWhenADeadlineCutsIt) {
  const Sender sender(message());
  const auto camera = open_camera(sender.settings());
  ASSERT_TRUE(camera) << camera.error().what;
  const auto early = (*camera)->next(now() + Duration::from_ms(20));
  ASSERT_TRUE(early);
  EXPECT_FALSE(*early);
  const auto frame = (*camera)->next(now() + Duration::from_ms(2000));
  ASSERT_TRUE(frame && *frame);
  EXPECT_EQ((*frame)->sequence, 9U);
  EXPECT_EQ((*frame)->acquired.ns, 77);
  EXPECT_EQ((*frame)->acquired_sigma.ns, 5);
  EXPECT_EQ((*frame)->width_px, 4);
  EXPECT_EQ((*(*frame)->rgb)[23], 23);
  EXPECT_EQ((*camera)->next(now() + Duration::from_ms(2000)).error().code, Errc::disconnected);
}

TEST(SocketCamera, RefusesWhatIsNoFrame) {
  auto bytes = message();
  bytes[48] = 25;  // a payload that does not fit the size
  const Sender sender(bytes);
  const auto camera = open_camera(sender.settings());
  ASSERT_TRUE(camera);
  EXPECT_EQ((*camera)->next(now() + Duration::from_ms(2000)).error().code, Errc::bad_format);
}

TEST(Camera, UnknownAndMissingSourcesAreNamed) {
  EXPECT_NE(open_camera({"webcam", 4, 2, 25}).error().what.find("webcam"), std::string::npos);
  EXPECT_EQ(open_camera({"socket:/nonexistent", 4, 2, 25}).error().code, Errc::not_found);
  EXPECT_EQ(open_camera({"v4l2:/nonexistent", 4, 2, 25}).error().code, Errc::not_found);
}

}  // namespace
}  // namespace birdseye::drivers
