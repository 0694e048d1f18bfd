#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <string>

namespace birdseye::testing {

/// An X server of its own without a screen, for as long as this lives. It picks its own number, so that tests may run
/// side by side.
class Display {
 public:
  explicit Display(const std::string& size = "640x480") {
    std::array<int, 2> fds{-1, -1};
    EXPECT_EQ(::pipe2(fds.data(), O_CLOEXEC), 0);
    child_ = ::fork();
    if (child_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      const int nowhere = ::open("/dev/null", O_RDWR);
      ::dup2(fds[1], STDOUT_FILENO);
      ::dup2(nowhere, STDERR_FILENO);
      ::execlp("Xvfb", "Xvfb", "-displayfd", "1", "-screen", "0", (size + "x24").c_str(), "-nolisten", "tcp",
               "-noreset", nullptr);
      ::_exit(127);
    }
    ::close(fds[1]);
    // It writes its number and a newline once clients may come.
    constexpr int kPatience_ms = 20'000;
    char c = 0;
    pollfd entry{fds[0], POLLIN, 0};
    while (::poll(&entry, 1, kPatience_ms) == 1 && ::read(fds[0], &c, 1) == 1 && c != '\n') number_ += c;
    ::close(fds[0]);
    EXPECT_FALSE(number_.empty()) << "Xvfb does not start: is the package xvfb installed?";
  }
  ~Display() {
    if (child_ <= 0) return;
    ::kill(child_, SIGTERM);
    ::waitpid(child_, nullptr, 0);
  }
  Display(const Display&) = delete;
  Display& operator=(const Display&) = delete;

  /// For run(): a program within it opens its windows there.
  [[nodiscard]] std::string name() const { return ":" + number_; }
  [[nodiscard]] std::string env() const { return "env -u WAYLAND_DISPLAY DISPLAY=:" + number_; }

 private:
  pid_t child_ = -1;
  std::string number_;
};

}  // namespace birdseye::testing
