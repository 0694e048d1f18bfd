#include "host/volume/isolated.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>

namespace birdseye::host {

namespace {

using Clock = std::chrono::steady_clock;

/// The copy's part: never returns.
[[noreturn]] void run_copy(
    int fd, const std::function<void(const std::function<void(const void* data, std::size_t size)>& send)>& work) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  if (const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC); nowhere >= 0) {
    ::dup2(nowhere, STDOUT_FILENO);
    ::dup2(nowhere, STDERR_FILENO);
  }
  // What work throws must not unwind into the copied stack: the objects on it are not ours to end.
  try {
    work([fd](const void* data, std::size_t size) {
      const auto* bytes = static_cast<const char*>(data);
      while (size > 0) {
        const ssize_t put = ::write(fd, bytes, size);
        if (put < 0 && errno == EINTR) continue;
        if (put <= 0) ::_exit(1);
        bytes += put;
        size -= static_cast<std::size_t>(put);
      }
    });
  } catch (...) {
    ::_exit(1);
  }
  ::_exit(0);
}

}  // namespace

Result<IsolatedOutcome> run_isolated(
    const std::function<void(const std::function<void(const void* data, std::size_t size)>& send)>& work,
    Duration within) {
  std::array<int, 2> fds{-1, -1};
  if (::pipe2(fds.data(), O_CLOEXEC) != 0) return Error{Errc::io, "no pipe is free for a decoder", errno};
  const pid_t child = ::fork();
  if (child < 0) {
    const int failed = errno;
    ::close(fds[0]);
    ::close(fds[1]);
    return Error{Errc::io, "no process is free for a decoder", failed};
  }
  if (child == 0) {
    ::close(fds[0]);
    run_copy(fds[1], work);
  }
  ::close(fds[1]);
  std::vector<std::uint8_t> chunk(1U << 20U);
  (void)::fcntl(fds[0], F_SETPIPE_SZ, static_cast<int>(chunk.size()));  // a volume is hundreds of megabytes
  IsolatedOutcome outcome;
  const auto deadline = Clock::now() + std::chrono::nanoseconds(within.ns);
  bool in_time = true;
  for (;;) {
    const auto left_ms = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    pollfd entry{fds[0], POLLIN, 0};
    const int ready = ::poll(&entry, 1, static_cast<int>(std::clamp<std::int64_t>(left_ms, 0, 1000)));
    if (ready == 0 && left_ms <= 0) {
      in_time = false;
      break;
    }
    if (ready <= 0) continue;
    const ssize_t got = ::read(fds[0], chunk.data(), chunk.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    outcome.bytes.insert(outcome.bytes.end(), chunk.begin(), chunk.begin() + got);
  }
  ::close(fds[0]);
  if (!in_time) ::kill(child, SIGKILL);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  outcome.ended_well = in_time && WIFEXITED(status) && WEXITSTATUS(status) == 0;
  return outcome;
}

}  // namespace birdseye::host
