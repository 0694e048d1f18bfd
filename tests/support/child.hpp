#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string>
#include <vector>

#include "drivers/system/wait.hpp"

namespace birdseye::testing {

/// A program of somebody else's, what it says collected while it runs. Killed when this goes.
class Child {
 public:
  explicit Child(const std::vector<std::string>& words) {
    std::array<int, 2> ends{-1, -1};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) return;
    std::vector<char*> arguments;
    arguments.reserve(words.size() + 1);
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    pid_ = ::fork();
    if (pid_ == 0) {
      ::dup2(ends[1], STDOUT_FILENO);
      ::dup2(ends[1], STDERR_FILENO);
      ::execvp(arguments[0], arguments.data());
      ::_exit(127);
    }
    ::close(ends[1]);
    output_fd_ = ends[0];
  }
  ~Child() {
    if (pid_ > 0) {
      ::kill(pid_, SIGKILL);
      ::waitpid(pid_, nullptr, 0);
    }
    if (output_fd_ >= 0) ::close(output_fd_);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  /// Standard output and standard error so far.
  [[nodiscard]] const std::string& output() const { return output_; }

  /// Takes what it says until that holds all of `words`; false at the deadline, or when it ends without them.
  bool says(const std::vector<std::string>& words, Deadline deadline) {
    while (!holds(words)) {
      if (!read_more(deadline)) return holds(words);
    }
    return true;
  }
  /// Takes the rest; its exit code, or -1 if it has not ended at the deadline or ended by a signal.
  int exit_code(Deadline deadline) {
    while (read_more(deadline)) {
    }
    for (int status = 0; pid_ > 0; ::usleep(2'000)) {
      const pid_t ended = ::waitpid(pid_, &status, WNOHANG);
      if (ended == pid_) {
        pid_ = -1;
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
      }
      if (deadline.passed()) break;
    }
    return -1;
  }
  /// Takes what it has said already, without waiting for more.
  void catch_up() {
    pollfd entry{output_fd_, POLLIN, 0};
    while (::poll(&entry, 1, 0) > 0 && read_more(Deadline::after(Duration::from_ms(1000)))) {
    }
  }
  [[nodiscard]] pid_t pid() const { return pid_; }
  void signal(int number) const {
    if (pid_ > 0) ::kill(pid_, number);
  }
  /// Takes what comes until nothing came for that long: it has digested what it was sent.
  void until_quiet(Duration quiet) {
    while (read_more(Deadline::after(quiet))) {
    }
  }

 private:
  [[nodiscard]] bool holds(const std::vector<std::string>& words) const {
    for (const std::string& word : words) {
      if (output_.find(word) == std::string::npos) return false;
    }
    return true;
  }
  bool read_more(Deadline deadline) {
    if (deadline.passed() || wait_ready(output_fd_, POLLIN, deadline) == 0) return false;
    std::array<char, 4096> chunk;
    const ssize_t got = ::read(output_fd_, chunk.data(), chunk.size());
    if (got > 0) output_.append(chunk.data(), static_cast<std::size_t>(got));
    return got > 0 || (got < 0 && errno == EINTR);
  }

  pid_t pid_ = -1;
  int output_fd_ = -1;
  std::string output_;
};

}  // namespace birdseye::testing
