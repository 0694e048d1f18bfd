#include "drivers/system/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>

#include "drivers/system/pipe.hpp"
#include "drivers/system/reap.hpp"
#include "drivers/system/wait.hpp"

extern char** environ;

namespace birdseye {

namespace {

constexpr Duration kGrace = Duration::from_ms(2000);  // to end by itself, once it is asked to

}  // namespace

Result<ChildProcess> ChildProcess::start(const std::vector<std::string>& command, const std::filesystem::path& log,
                                         Pipe pipe, Signals signals, Life life) {
  birdseye::Pipe ends;
  if (pipe != Pipe::none) {
    auto opened = birdseye::Pipe::open();
    if (!opened) return std::move(opened).error();
    ends = *std::move(opened);
  }
  const bool child_writes = pipe == Pipe::stdout_from_child;
  UniqueFd ours = std::move(child_writes ? ends.out : ends.in);
  const UniqueFd theirs = std::move(child_writes ? ends.in : ends.out);

  birdseye::Pipe lifeline;
  if (life == Life::ours) {
    auto opened = birdseye::Pipe::open();
    if (!opened) return std::move(opened).error();
    lifeline = *std::move(opened);
  }

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  const int log_flags = O_WRONLY | O_CREAT | O_APPEND;
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, log.c_str(), log_flags, 0644);
  if (pipe == Pipe::stdin_to_child) {
    posix_spawn_file_actions_adddup2(&actions, theirs.get(), STDIN_FILENO);
  } else if (life == Life::ours) {
    posix_spawn_file_actions_adddup2(&actions, lifeline.out.get(), STDIN_FILENO);
  } else {
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  }
  if (child_writes) {
    posix_spawn_file_actions_adddup2(&actions, theirs.get(), STDOUT_FILENO);
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
  if (failed != 0) {
    return Error{Errc::not_found, fmt::format("{}: cannot be started; is it built and installed?", command[0])};
  }
  if (ours) ::fcntl(ours.get(), F_SETFL, O_NONBLOCK);
  return ChildProcess(pid, std::move(ours), std::move(lifeline.in), command[0]);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      fd_(std::move(other.fd_)),
      lifeline_(std::move(other.lifeline_)),
      name_(std::move(other.name_)),
      buffer_(std::move(other.buffer_)),
      exit_code_(other.exit_code_) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  if (this != &other) {
    stop();
    pid_ = std::exchange(other.pid_, -1);
    fd_ = std::move(other.fd_);
    lifeline_ = std::move(other.lifeline_);
    name_ = std::move(other.name_);
    buffer_ = std::move(other.buffer_);
    exit_code_ = other.exit_code_;
  }
  return *this;
}

ChildProcess::~ChildProcess() {
  stop();
}

void ChildProcess::close_pipe() {
  fd_ = UniqueFd();
}

Result<std::optional<std::string>> ChildProcess::read_line(Deadline deadline) {
  for (;;) {
    if (const auto end = buffer_.find('\n'); end != std::string::npos) {
      std::string line = buffer_.substr(0, end);
      buffer_.erase(0, end + 1);
      return std::optional<std::string>(std::move(line));
    }
    if (!wait_ready(fd_.get(), POLLIN, deadline)) return std::optional<std::string>();
    char chunk[4096];
    const ssize_t got = ::read(fd_.get(), chunk, sizeof chunk);
    if (got > 0) {
      buffer_.append(chunk, static_cast<std::size_t>(got));
    } else if (got == 0 || (errno != EAGAIN && errno != EINTR)) {
      return Error{Errc::disconnected, fmt::format("{}: ended early; its log says why", name_)};
    }
  }
}

Result<std::size_t> ChildProcess::read(void* bytes, std::size_t size, Deadline deadline) {
  std::size_t have = 0;
  while (have < size) {
    if (!wait_ready(fd_.get(), POLLIN, deadline)) return Error{Errc::timeout, fmt::format("{}: gives nothing", name_)};
    const ssize_t got = ::read(fd_.get(), static_cast<char*>(bytes) + have, size - have);
    if (got > 0) {
      have += static_cast<std::size_t>(got);
    } else if (got == 0 || (errno != EAGAIN && errno != EINTR)) {
      break;
    }
  }
  return have;
}

Result<void> ChildProcess::write(const void* bytes, std::size_t size, Deadline deadline) {
  const char* data = static_cast<const char*>(bytes);
  while (size > 0) {
    if (!wait_ready(fd_.get(), POLLOUT, deadline)) {
      return Error{Errc::timeout, fmt::format("{}: does not take its input", name_)};
    }
    const ssize_t put = ::write(fd_.get(), data, size);
    if (put > 0) {
      data += put;
      size -= static_cast<std::size_t>(put);
    } else if (errno != EAGAIN && errno != EINTR) {
      return Error{Errc::disconnected, fmt::format("{}: ended early; its log says why", name_)};
    }
  }
  return {};
}

std::optional<int> ChildProcess::wait(Deadline deadline) {
  if (pid_ > 0) {
    const auto status = reap(pid_, deadline);
    if (!status) return std::nullopt;
    exit_code_ = WIFEXITED(*status) ? WEXITSTATUS(*status) : 128 + WTERMSIG(*status);
    pid_ = -1;
  }
  return exit_code_;
}

void ChildProcess::bound_memory(std::uint64_t bytes) {
  if (pid_ <= 0) return;  // to the system, 0 is ourselves
  const rlimit limit{bytes, bytes};
  (void)::prlimit(pid_, RLIMIT_AS, &limit, nullptr);
}

void ChildProcess::stop() {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGTERM);
  if (wait(Deadline::after(kGrace))) return;
  ::kill(pid_, SIGKILL);
  wait(Deadline::after(kGrace));
}

}  // namespace birdseye
