#include "tests/vm/process.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>

#include "drivers/system/wait.hpp"

namespace birdseye::vm {

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
    if (wait(Deadline::after(Duration::from_ms(5000))) < 0) {
      ::kill(pid_, SIGKILL);
      (void)wait(Deadline::after(Duration::from_ms(5000)));
    }
  }
  if (in_ >= 0) ::close(in_);
  if (out_ >= 0) ::close(out_);
}

void Process::send(const std::string& line) const {
  const std::string bytes = line + "\n";
  (void)!::write(in_, bytes.data(), bytes.size());
}

std::string Process::wait_for(const std::string& text, Deadline deadline) {
  for (;;) {
    for (std::size_t end = 0; (end = text_.find('\n')) != std::string::npos;) {
      const std::string line = text_.substr(0, end);
      text_.erase(0, end + 1);
      if (line.find(text) != std::string::npos) return line;
    }
    if (deadline.passed() || wait_ready(out_, POLLIN, deadline) == 0) return {};
    std::array<char, 4096> chunk;
    const ssize_t got = ::read(out_, chunk.data(), chunk.size());
    if (got <= 0) return {};
    text_.append(chunk.data(), static_cast<std::size_t>(got));
  }
}

int Process::wait(Deadline deadline) {
  while (code_ < 0) {
    int status = 0;
    if (::waitpid(pid_, &status, WNOHANG) == pid_) {
      code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    } else if (deadline.passed()) {
      return -1;
    } else {
      sleep_for(Duration::from_ms(10));
    }
  }
  return code_;
}

}  // namespace birdseye::vm
