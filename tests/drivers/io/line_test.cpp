#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netdb.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstring>
#include <optional>

#include "drivers/io/libusb_port.hpp"
#include "drivers/io/open_line.hpp"
#include "drivers/io/socket_line.hpp"
#include "drivers/io/usb_address.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/unique_fd.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::drivers {
namespace {

using ::testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

constexpr Duration kLong = Duration::from_ms(20'000);

/// A serial server of one line, or what stands in for it.
struct Listener {
  static Listener tcp() {
    Listener listener;
    listener.fd = UniqueFd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(::bind(listener.fd.get(), reinterpret_cast<const sockaddr*>(&address), size), 0);
    EXPECT_EQ(::getsockname(listener.fd.get(), reinterpret_cast<sockaddr*>(&address), &size), 0);
    EXPECT_EQ(::listen(listener.fd.get(), 4), 0);
    listener.device = "tcp:127.0.0.1:" + std::to_string(ntohs(address.sin_port));
    return listener;
  }
  static Listener unix_socket(const std::filesystem::path& path) {
    Listener listener;
    listener.fd = UniqueFd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(listener.fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(listener.fd.get(), 4), 0);
    listener.device = "unix:" + path.string();
    return listener;
  }
  [[nodiscard]] UniqueFd accept() const { return UniqueFd(::accept(fd.get(), nullptr, nullptr)); }

  UniqueFd fd;
  std::string device;
};

LineSettings line_to(std::string device) {
  LineSettings settings;
  settings.device = std::move(device);
  return settings;
}

void carries_bytes_and_ends(const Listener& listener) {
  const auto line = open_line(line_to(listener.device));
  ASSERT_TRUE(line) << line.error().what;
  UniqueFd peer = listener.accept();
  EXPECT_EQ((*line)->name(), listener.device);
  EXPECT_FALSE((*line)->set_rts(true));
  EXPECT_FALSE((*line)->arrival());
  Bytes chunk(16);
  EXPECT_EQ(*(*line)->read(chunk, device_now() + Duration::from_ms(5)), 0U);

  const Bytes sent{0x00, 0xFF, 0x11, 0x13};
  ASSERT_TRUE((*line)->write(sent, device_now() + kLong));
  ASSERT_EQ(::recv(peer.get(), chunk.data(), chunk.size(), 0), 4);
  EXPECT_TRUE(std::equal(sent.begin(), sent.end(), chunk.begin()));
  ASSERT_EQ(::send(peer.get(), sent.data(), sent.size(), 0), 4);
  ASSERT_EQ(*(*line)->read(chunk, device_now() + kLong), 4U);
  EXPECT_TRUE(std::equal(sent.begin(), sent.end(), chunk.begin()));

  ASSERT_EQ(::send(peer.get(), sent.data(), sent.size(), 0), 4);
  ASSERT_EQ(*(*line)->read(std::span(chunk).first(1), device_now() + kLong), 1U);  // all four are here now
  (*line)->discard_input();
  EXPECT_EQ(*(*line)->read(chunk, device_now() + Duration::from_ms(5)), 0U);
  EXPECT_EQ((*line)->line_errors(), 0U);

  EXPECT_EQ((*line)->write(Bytes(64U << 20, 1), device_now() + Duration::from_ms(50)).error().code, Errc::timeout);
  peer = UniqueFd();
  const auto after = (*line)->read(chunk, device_now() + kLong);
  ASSERT_FALSE(after);
  EXPECT_EQ(after.error().code, Errc::disconnected);
  EXPECT_THAT(after.error().what, HasSubstr(listener.device));
  EXPECT_EQ((*line)->write(Bytes(64U << 20, 1), device_now() + kLong).error().code,
            Errc::disconnected);  // and no SIGPIPE
}

TEST(SocketLine, CarriesBytesOverTcpAndSeesTheEnd) {
  carries_bytes_and_ends(Listener::tcp());
}

TEST(SocketLine, CarriesBytesOverAUnixSocketAndSeesTheEnd) {
  const birdseye::testing::Scratch scratch;
  carries_bytes_and_ends(Listener::unix_socket(scratch / "line"));
}

TEST(SocketLine, WatchesForADeadPeerAndHoldsNoByteBack) {
  const Listener listener = Listener::tcp();
  const auto line = open_line(line_to(listener.device));
  ASSERT_TRUE(line);
  EXPECT_EQ((*line)->describe(), listener.device + ": connected, no delay, a dead peer is seen within 5 s");
}

TEST(SocketLine, FindsAHostByName) {
  if (::gethostbyname("localhost") == nullptr) GTEST_SKIP() << "this machine does not know localhost by name";
  const Listener listener = Listener::tcp();
  std::string device = listener.device;
  device.replace(4, 9, "localhost");
  const auto line = open_line(line_to(device));
  ASSERT_TRUE(line) << line.error().what;
  EXPECT_TRUE(listener.accept());
}

TEST(SocketLine, NobodyListeningIsSaid) {
  std::string device;
  { device = Listener::tcp().device; }
  const auto refused = open_line(line_to(device));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::not_found);
  EXPECT_THAT(refused.error().what, HasSubstr(device));
  EXPECT_EQ(open_line(line_to("unix:/nonexistent/line")).error().code, Errc::not_found);
  EXPECT_EQ(open_line(line_to("unix:/" + std::string(200, 'x'))).error().code, Errc::bad_value);
}

TEST(SocketLine, AServerThatDoesNotAcceptIsATimeout) {
  const birdseye::testing::Scratch scratch;
  const Listener listener = Listener::unix_socket(scratch / "line");
  ASSERT_EQ(::listen(listener.fd.get(), 0), 0);
  std::vector<std::unique_ptr<ByteStream>> lines;
  std::optional<Error> refused;
  for (int i = 0; i < 10 && !refused; ++i) {
    auto line = open_line(line_to(listener.device));
    if (line) {
      lines.push_back(*std::move(line));
    } else {
      refused = line.error();
    }
  }
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code, Errc::timeout);
}

TEST(OpenLine, AWrongDeviceIsToldWhatThereIs) {
  for (const char* device : {"", "ttyUSB0", "serial:/dev/ttyUSB0", "unix:relative", "COM3"}) {
    const auto checked = check_line(line_to(device));
    ASSERT_FALSE(checked) << device;
    EXPECT_EQ(checked.error().code, Errc::bad_value);
    for (const char* form : {"/dev/", "usb:", "tcp:", "unix:"}) EXPECT_THAT(checked.error().what, HasSubstr(form));
    EXPECT_EQ(open_line(line_to(device)).error().code, Errc::bad_value);
  }
}

TEST(OpenLine, ChecksEachFormBeforeItIsOpened) {
  for (const char* device : {"/dev/ttyUSB0", "usb:0403:6001", "usb:0403:6001:TRK001", "tcp:10.0.0.7:4001",
                             "tcp:tracker.local:4001", "tcp:[::1]:4001", "unix:/run/tracker"}) {
    EXPECT_TRUE(check_line(line_to(device))) << device;
  }
  for (const char* device :
       {"usb:403:6001", "usb:0403:6001:", "usb:0403:60x1", "usb:0403", "usb:", "usb:0403:6001X", "tcp:host",
        "tcp::4001", "tcp:host:0", "tcp:host:65536", "tcp:host:40x", "tcp:::1:4001", "tcp:[]:1"}) {
    EXPECT_FALSE(check_line(line_to(device))) << device;
  }
  LineSettings settings = line_to("tcp:10.0.0.7:4001");
  settings.baud = 1234;
  EXPECT_THAT(check_line(settings).error().what, HasSubstr("1234"));
  settings.baud = 9600;
  for (const int latency_ms : {0, 256}) {
    settings.usb_latency_ms = latency_ms;
    EXPECT_FALSE(check_line(settings));
  }
}

TEST(OpenLine, AnAdapterThatIsNotThereIsSaidToBeMissing) {
  const auto line = open_line(line_to("usb:dead:beef"));
  ASSERT_FALSE(line);
  EXPECT_THAT(line.error().what, HasSubstr("usb:dead:beef"));
}

TEST(UsbAddress, ChoosesTheOneMeant) {
  const std::vector<UsbCandidate> bus{{0x1d6b, 0x0002, "hub", ""},
                                      {0x0403, 0x6001, "FT232R USB UART", "A"},
                                      {0x0403, 0x6001, "FT232R USB UART", "B"},
                                      {0x0403, 0x6015, "FT231X", "C"}};
  EXPECT_EQ(*choose_adapter(bus, *parse_usb_address("usb:0403:6015")), 3U);
  EXPECT_EQ(*choose_adapter(bus, *parse_usb_address("usb:0403:6001:B")), 2U);
  const auto two = choose_adapter(bus, *parse_usb_address("usb:0403:6001"));
  ASSERT_FALSE(two);
  EXPECT_EQ(two.error().code, Errc::bad_value);
  EXPECT_THAT(two.error().what, HasSubstr("usb:0403:6001:A"));
  EXPECT_THAT(two.error().what, HasSubstr("usb:0403:6001:B"));
  const auto other = choose_adapter(bus, *parse_usb_address("usb:0403:6001:Z"));
  EXPECT_EQ(other.error().code, Errc::not_found);
  EXPECT_THAT(other.error().what, HasSubstr("usb:0403:6001:A"));
  const auto absent = choose_adapter(bus, *parse_usb_address("usb:0403:6014"));
  EXPECT_EQ(absent.error().code, Errc::not_found);
  EXPECT_THAT(absent.error().what, HasSubstr("usb:0403:6015:C (FT231X)"));
  const std::vector<UsbCandidate> twins{bus[1], bus[1]};
  EXPECT_THAT(choose_adapter(twins, *parse_usb_address("usb:0403:6001:A")).error().what, HasSubstr("unplug"));
  EXPECT_THAT(choose_adapter({}, *parse_usb_address("usb:0403:6001")).error().what, HasSubstr("plugged in?"));
}

TEST(UsbError, NamesTheRemedy) {
  constexpr int kAccess = -3, kNoDevice = -4, kBusy = -6, kTimeout = -7, kPipe = -9;  // as libusb numbers them
  EXPECT_EQ(usb_error("usb:0403:6001", kAccess, "open it").code, Errc::unreadable);
  EXPECT_THAT(usb_error("usb:0403:6001", kAccess, "open it").what, HasSubstr("60-birdseye.rules"));
  EXPECT_EQ(usb_error("usb:0403:6001", kNoDevice, "").code, Errc::disconnected);
  EXPECT_EQ(usb_error("usb:0403:6001", kBusy, "").code, Errc::in_use);
  EXPECT_THAT(usb_error("usb:0403:6001", kBusy, "").what, HasSubstr("usb:0403:6001"));
  EXPECT_EQ(usb_error("usb:0403:6001", kTimeout, "").code, Errc::timeout);
  EXPECT_EQ(usb_error("usb:0403:6001", kPipe, "").code, Errc::unsupported);
}

}  // namespace
}  // namespace birdseye::drivers
