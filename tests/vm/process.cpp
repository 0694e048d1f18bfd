#include "tests/vm/process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <thread>

namespace birdseye::vm {

using namespace std::chrono_literals;

Process::Process(const std::vector<std::string>& command, const std::filesystem::path& log) {
  std::array<int, 2> to{}, from{};
  if (::pipe2(to.data(), O_CLOEXEC) != 0 || ::pipe2(from.data(), O_CLOEXEC) != 0) return;
  const int errors = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));  // NOLINT: execvp's way
  arguments.push_back(nullptr);
  pid_ = ::fork();
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    ::dup2(to[0], STDIN_FILENO);
    ::dup2(from[1], STDOUT_FILENO);
    ::dup2(errors, STDERR_FILENO);
    ::execvp(arguments[0], arguments.data());
    ::_exit(127);
  }
  ::close(to[0]);
  ::close(from[1]);
  ::close(errors);
  in_ = to[1];
  out_ = from[0];
}

Process::~Process() {
  if (pid_ > 0 && code_ < 0) {
    ::kill(pid_, SIGTERM);
    if (wait(Clock::now() + 5s) < 0) {
      ::kill(pid_, SIGKILL);
      (void)wait(Clock::now() + 5s);
    }
  }
  if (in_ >= 0) ::close(in_);
  if (out_ >= 0) ::close(out_);
}

void Process::send(const std::string& line) const {
  const std::string bytes = line + "\n";
  (void)!::write(in_, bytes.data(), bytes.size());
}

std::string Process::wait_for(const std::string& text, Clock::time_point deadline) {
  for (;;) {
    for (std::size_t end = 0; (end = text_.find('\n')) != std::string::npos;) {
      const std::string line = text_.substr(0, end);
      text_.erase(0, end + 1);
      if (line.find(text) != std::string::npos) return line;
    }
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    pollfd entry{out_, POLLIN, 0};
    if (left.count() <= 0 || ::poll(&entry, 1, static_cast<int>(left.count())) < 0) return {};
    std::array<char, 4096> chunk;
    const ssize_t got = entry.revents != 0 ? ::read(out_, chunk.data(), chunk.size()) : 0;
    if (got <= 0) return {};
    text_.append(chunk.data(), static_cast<std::size_t>(got));
  }
}

int Process::wait(Clock::time_point deadline) {
  while (code_ < 0) {
    int status = 0;
    if (::waitpid(pid_, &status, WNOHANG) == pid_) {
      code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    } else if (Clock::now() > deadline) {
      return -1;
    } else {
      std::this_thread::sleep_for(10ms);
    }
  }
  return code_;
}

}  // namespace birdseye::vm
