#include "drivers/system/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <thread>

extern char** environ;

namespace birdseye::host {

namespace {

using Clock = std::chrono::steady_clock;

int remaining_ms(Clock::time_point deadline) {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
  return static_cast<int>(std::clamp<std::int64_t>(left, 0, 60'000));
}

}  // namespace

Result<ChildProcess> ChildProcess::start(const std::vector<std::string>& command, const std::filesystem::path& log,
                                         Pipe pipe, Signals signals) {
  int fds[2] = {-1, -1};
  if (pipe != Pipe::none && ::pipe2(fds, O_CLOEXEC) != 0) return Error{Errc::io, "pipe: no descriptors left", errno};
  const bool child_writes = pipe == Pipe::stdout_from_child;
  const int ours = pipe == Pipe::none ? -1 : fds[child_writes ? 0 : 1];
  const int theirs = pipe == Pipe::none ? -1 : fds[child_writes ? 1 : 0];

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  const int log_flags = O_WRONLY | O_CREAT | O_APPEND;
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, log.c_str(), log_flags, 0644);
  if (pipe == Pipe::stdin_to_child) {
    posix_spawn_file_actions_adddup2(&actions, theirs, STDIN_FILENO);
  } else {
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  }
  if (child_writes) {
    posix_spawn_file_actions_adddup2(&actions, theirs, STDOUT_FILENO);
  } else {
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(), log_flags, 0644);
  }

  std::vector<std::string> arguments = command;
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  if (signals == Signals::ours_alone) posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  pid_t pid = -1;
  const int failed = posix_spawnp(&pid, argv[0], &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (theirs >= 0) ::close(theirs);
  if (failed != 0) {
    if (ours >= 0) ::close(ours);
    return Error{Errc::not_found, fmt::format("{}: cannot be started; is it built and installed?", command[0]), failed};
  }
  if (ours >= 0) ::fcntl(ours, F_SETFL, O_NONBLOCK);
  return ChildProcess(pid, ours, command[0]);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      fd_(std::exchange(other.fd_, -1)),
      name_(std::move(other.name_)),
      buffer_(std::move(other.buffer_)),
      exit_code_(other.exit_code_) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  if (this != &other) {
    stop();
    close_fd();
    pid_ = std::exchange(other.pid_, -1);
    fd_ = std::exchange(other.fd_, -1);
    name_ = std::move(other.name_);
    buffer_ = std::move(other.buffer_);
    exit_code_ = other.exit_code_;
  }
  return *this;
}

ChildProcess::~ChildProcess() {
  stop();
  close_fd();
}

void ChildProcess::close_fd() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

void ChildProcess::close_input() {
  close_fd();
}

Result<std::optional<std::string>> ChildProcess::read_line(Clock::time_point deadline) {
  for (;;) {
    if (const auto end = buffer_.find('\n'); end != std::string::npos) {
      std::string line = buffer_.substr(0, end);
      buffer_.erase(0, end + 1);
      return std::optional<std::string>(std::move(line));
    }
    pollfd entry{fd_, POLLIN, 0};
    const int ready = ::poll(&entry, 1, remaining_ms(deadline));
    if (ready == 0 && Clock::now() >= deadline) return std::optional<std::string>();
    if (ready <= 0) continue;
    char chunk[4096];
    const ssize_t got = ::read(fd_, chunk, sizeof chunk);
    if (got > 0) {
      buffer_.append(chunk, static_cast<std::size_t>(got));
    } else if (got == 0 || (errno != EAGAIN && errno != EINTR)) {
      return Error{Errc::disconnected, fmt::format("{}: ended early; its log says why", name_)};
    }
  }
}

Result<std::size_t> ChildProcess::read(void* bytes, std::size_t size, Clock::time_point deadline) {
  std::size_t have = 0;
  while (have < size) {
    pollfd entry{fd_, POLLIN, 0};
    const int ready = ::poll(&entry, 1, remaining_ms(deadline));
    if (ready == 0 && Clock::now() >= deadline) return Error{Errc::timeout, fmt::format("{}: gives nothing", name_)};
    if (ready <= 0) continue;
    const ssize_t got = ::read(fd_, static_cast<char*>(bytes) + have, size - have);
    if (got > 0) {
      have += static_cast<std::size_t>(got);
    } else if (got == 0 || (errno != EAGAIN && errno != EINTR)) {
      break;
    }
  }
  return have;
}

Result<void> ChildProcess::write(const void* bytes, std::size_t size, Clock::time_point deadline) {
  const char* data = static_cast<const char*>(bytes);
  while (size > 0) {
    pollfd entry{fd_, POLLOUT, 0};
    if (::poll(&entry, 1, remaining_ms(deadline)) == 0 && Clock::now() >= deadline) {
      return Error{Errc::timeout, fmt::format("{}: does not take its input", name_)};
    }
    const ssize_t put = ::write(fd_, data, size);
    if (put > 0) {
      data += put;
      size -= static_cast<std::size_t>(put);
    } else if (errno != EAGAIN && errno != EINTR) {
      return Error{Errc::disconnected, fmt::format("{}: ended early; its log says why", name_), errno};
    }
  }
  return {};
}

std::optional<int> ChildProcess::wait(Clock::time_point deadline) {
  while (pid_ > 0) {
    int status = 0;
    if (::waitpid(pid_, &status, WNOHANG) == pid_) {
      exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
      pid_ = -1;
      break;
    }
    if (Clock::now() >= deadline) return std::nullopt;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return exit_code_;
}

void ChildProcess::stop() {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGTERM);
  if (wait(Clock::now() + std::chrono::seconds(2))) return;
  ::kill(pid_, SIGKILL);
  wait(Clock::now() + std::chrono::seconds(2));
}

}  // namespace birdseye::host
