#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstring>

#include "device/wire/client.hpp"
#include "device/wire/server.hpp"
#include "drivers/system/clock.hpp"
#include "hw-sim/minibird/pseudo_terminal.hpp"
#include "tests/support/child.hpp"
#include "tests/support/command.hpp"
#include "tests/support/programs_folder.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

using testing::run;
using testing::Scratch;

/// A Unix socket that takes a connection and never sends a frame.
class SilentCamera {
 public:
  explicit SilentCamera(const std::string& path) : fd_(::socket(AF_UNIX, SOCK_STREAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(fd_, 1), 0);
  }
  ~SilentCamera() { ::close(fd_); }

 private:
  int fd_;
};

/// systemd's side of sd_notify(3).
class ServiceManager {
 public:
  explicit ServiceManager(std::string path)
      : path_(std::move(path)), fd_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path_.c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    const timeval patience{20, 0};
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }
  ~ServiceManager() { ::close(fd_); }
  [[nodiscard]] std::string variable() const { return "NOTIFY_SOCKET=" + path_; }
  /// The next of what it is told that begins so; empty if it does not come.
  [[nodiscard]] std::string told(const std::string& beginning) const {
    std::array<char, 4096> message;
    for (;;) {
      const ssize_t got = ::recv(fd_, message.data(), message.size(), 0);
      if (got <= 0) return {};
      const std::string text(message.data(), static_cast<std::size_t>(got));
      if (text.starts_with(beginning)) return text;
    }
  }

 private:
  std::string path_;
  int fd_;
};

std::string config(const std::string& device, const std::string& camera, int port) {
  return "[tracker]\ndevice = \"" + device + "\"\n[camera]\nsource = \"" + camera +
         "\"\n[wire]\nport = " + std::to_string(port) + "\n";
}

void expect_one_line(const testing::CommandResult& result, const std::vector<std::string>& words) {
  EXPECT_EQ(result.code, 2) << result.output;
  EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
  for (const std::string& word : words) EXPECT_NE(result.output.find(word), std::string::npos) << result.output;
}

TEST(Appliance, APortInUseIsNamed) {
  const Scratch scratch;
  const auto server = wire::Server::listen("127.0.0.1", 0);
  const std::string port = std::to_string((*server)->port());
  expect_one_line(run("birdseyed", "--config " + scratch.file("c.toml", config("/dev/null", "socket:/nonexistent",
                                                                               (*server)->port()))),
                  {"port " + port, "in use"});
}

TEST(Appliance, AProbeNamesEachInstrumentThatCannotBeUsed) {
  const Scratch scratch;
  const auto terminal = hw_sim::PseudoTerminal::open(scratch / "tty");
  ASSERT_TRUE(terminal) << terminal.error().what;
  const SilentCamera camera((scratch / "camera").string());
  const std::string path =
      scratch.file("c.toml", config((scratch / "tty").string(), "socket:" + (scratch / "camera").string(), 0));
  const auto result = run("birdseyed", "--probe --config " + path);
  EXPECT_EQ(result.code, 2) << result.output;
  EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 2) << result.output;
  for (const char* words : {"tty", "does not answer", "power, cable", "the camera sends no frames"})
    EXPECT_NE(result.output.find(words), std::string::npos) << result.output;
}

TEST(Appliance, TellsTheServiceManagerAndTakesAReloadWhileClientsStay) {
  const Scratch scratch;
  const ServiceManager manager((scratch / "notify").string());
  const std::string camera = "socket:" + (scratch / "camera").string(),
                    record = "[record]\nfolder = \"" + (scratch / "rec").string() + "\"\n";
  const int port = [] {
    const auto free = wire::Server::listen("127.0.0.1", 0);
    return (*free)->port();
  }();
  const std::string path = scratch.file("c.toml", config((scratch / "tty").string(), camera, port) + record);
  testing::Child daemon({"env", manager.variable(), testing::programs_folder() + "/birdseyed", "--config", path});
  const auto deadline = Deadline::after(Duration::from_ms(30'000));
  EXPECT_NE(manager.told("READY=1"), "");
  EXPECT_NE(manager.told("WATCHDOG=1"), "");
  auto client = wire::Client::connect("127.0.0.1", port, deadline);
  ASSERT_TRUE(client) << client.error().what;

  // At once after the start: the recording's name must not be that of the one before.
  const std::string other = (scratch / "other").string();
  (void)scratch.file("c.toml", config((scratch / "tty").string(), "socket:" + other, port) + record);
  daemon.signal(SIGHUP);
  EXPECT_NE(manager.told("RELOADING=1"), "");
  EXPECT_NE(manager.told("READY=1"), "");
  bool took_effect = false;
  while (!took_effect) {
    const auto event = (*client)->next(deadline);
    ASSERT_TRUE(event) << event.error().what;
    ASSERT_TRUE(*event) << "nothing says that the new camera is looked for";
    const auto* const status = std::get_if<wire::Status>(&**event);
    took_effect = status != nullptr && status->text.find(other) != std::string::npos;
  }
  daemon.signal(SIGHUP);
  EXPECT_TRUE(daemon.says({"configuration read again", "configuration unchanged"}, deadline)) << daemon.output();

  (void)scratch.file("c.toml", "nonsense");
  daemon.signal(SIGHUP);
  EXPECT_TRUE(daemon.says({"going on with the one before"}, deadline)) << daemon.output();
  EXPECT_NE(manager.told("WATCHDOG=1"), "");
  daemon.signal(SIGTERM);
  EXPECT_NE(manager.told("STOPPING=1"), "");
  EXPECT_EQ(daemon.exit_code(deadline), 0) << daemon.output();
}

}  // namespace
}  // namespace birdseye
