// The manual's example clients, in C++ and in Python, at the simulated appliance.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#include "tests/support/child.hpp"
#include "tests/support/programs_folder.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

using testing::Child;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::programs_folder;
using testing::Scratch;

Deadline soon() {
  return Deadline::after(Duration::from_ms(60'000));
}

/// The simulated instruments and birdseyed, as the manual starts them.
class SimulatedAppliance {
 public:
  SimulatedAppliance()
      : tracker_({programs_folder() + "/birdseye-sim", "minibird", "--tty", tty()}),
        camera_(
            {programs_folder() + "/birdseye-sim", "camera", "--socket", socket(), "--size", "96x64", "--rate", "25"}),
        appliance_({programs_folder() + "/birdseyed", "--config",
                    scratch_.file("sim.toml", "[tracker]\ndevice = \"" + tty() + "\"\n[camera]\nsource = \"socket:" +
                                                  socket() + "\"\nrate_hz = 25\n[wire]\nport = 0\n")}) {}
  /// Empty where it does not say it.
  std::string port() {
    const std::string before = "publishing on 127.0.0.1 port ";
    if (!appliance_.says({before, "status: all is well"}, soon())) return {};
    const auto at = appliance_.output().find(before) + before.size();
    return appliance_.output().substr(at, appliance_.output().find_first_not_of("0123456789", at) - at);
  }

 private:
  [[nodiscard]] std::string tty() const { return (scratch_ / "bird").string(); }
  [[nodiscard]] std::string socket() const { return (scratch_ / "cam").string(); }
  Scratch scratch_;
  Child tracker_, camera_, appliance_;
};

std::string examples() {
  const char* const source = std::getenv("BIRDSEYE_SOURCE_DIR");
  return std::string(source != nullptr ? source : ".") + "/docs/manual/examples";
}

/// On the circle that the simulated scope goes round, and of times that grow.
void expect_poses(const std::string& output, int count) {
  std::istringstream lines(output);
  double before = 0;
  int poses = 0;
  for (std::string line; std::getline(lines, line);) {
    double at = 0, x = 0, y = 0, z = 0;
    if (std::sscanf(line.c_str(), "ScopeToTracker %lf s %lf %lf %lf mm", &at, &x, &y, &z) != 4) continue;
    EXPECT_NEAR(std::hypot(x - 400, y), 200, 1) << line;
    EXPECT_GT(at, before) << line;
    before = at;
    ++poses;
  }
  EXPECT_EQ(poses, count) << output;
}

TEST(ExampleClients, ReadPosesPicturesAndStatusOfTheSimulatedAppliance) {
  SimulatedAppliance appliance;
  const std::string port = appliance.port();
  ASSERT_FALSE(port.empty());
  for (const std::vector<std::string>& program :
       {std::vector<std::string>{"python3", examples() + "/poses.py"}, {programs_folder() + "/../peers/poses"}}) {
    SCOPED_TRACE(program.back());
    std::vector<std::string> words = program;
    words.insert(words.end(), {"127.0.0.1", port, "50"});
    Child client(words);
    EXPECT_EQ(client.exit_code(soon()), 0) << client.output();
    expect_poses(client.output(), 50);
    EXPECT_THAT(client.output(), HasSubstr("birdseyed            OK"));
    EXPECT_THAT(client.output(), HasSubstr("96 x 64, 3 components"));
  }
}

/// One plain sentence and exit code 1.
void expect_sentence(const std::vector<std::string>& words, const std::string& says) {
  SCOPED_TRACE(words[1]);
  Child client(words);
  EXPECT_EQ(client.exit_code(soon()), 1) << client.output();
  EXPECT_THAT(client.output(), HasSubstr(says));
  EXPECT_THAT(client.output(), Not(HasSubstr("Traceback")));
  EXPECT_EQ(std::ranges::count(client.output(), '\n'), 1) << client.output();
}

/// Each Python client, and what it is told of a server at a port.
std::vector<std::vector<std::string>> python_clients(const std::string& port) {
  return {{"python3", examples() + "/poses.py", "127.0.0.1", port, "3"},
          {"python3", examples() + "/watch.py", "127.0.0.1", port},
          {"python3", examples() + "/track.py", "tcp:127.0.0.1:" + port, "3"}};
}

TEST(ExampleClients, SayInASentenceThatNobodyAnswers) {
  for (const auto& words : python_clients("1")) expect_sentence(words, "127.0.0.1:1 (");
  expect_sentence({"python3", examples() + "/track.py", "/nowhere/tty", "3"}, "no tracker at /nowhere/tty");
}

TEST(ExampleClients, SayInASentenceThatTheServerHasGone) {
  for (std::size_t i = 0; i < python_clients("1").size(); ++i) {
    Child server(
        {"python3", "-c",
         "import socket; server = socket.create_server((\"127.0.0.1\", 0))\n"
         "print(\"port\", server.getsockname()[1], \"of it\", flush=True)\n"
         "peer = server.accept()[0]; peer.sendall(b\"\\0\\1TRANS\"); peer.shutdown(socket.SHUT_WR); peer.recv(9)"});
    ASSERT_TRUE(server.says({"of it"}, soon()));
    const std::string& told = server.output();
    const auto at = told.find("port ") + 5;
    expect_sentence(python_clients(told.substr(at, told.find(' ', at) - at))[i], "has gone");
  }
}

}  // namespace
}  // namespace birdseye
