#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>

#include "device/wire/server.hpp"
#include "hw-sim/minibird/pseudo_terminal.hpp"
#include "tests/support/command.hpp"
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

}  // namespace
}  // namespace birdseye
