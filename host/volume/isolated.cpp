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
#include <mutex>

#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::host {

namespace {

std::shared_mutex& copying() {
  static std::shared_mutex mutex;
  return mutex;
}

/// The copy's part: never returns.
[[noreturn]] void run_copy(int fd, const std::function<void(const Send&)>& work) {
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

/// The other end of the pipe. Ends the copy with itself.
class Copy {
 public:
  Copy(pid_t process, int fd, Duration within) : process_(process), fd_(fd), deadline_(Deadline::after(within)) {}
  ~Copy() {
    ::close(fd_);
    ::kill(process_, SIGKILL);
    int status = 0;
    while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
    }
  }
  Copy(const Copy&) = delete;
  Copy& operator=(const Copy&) = delete;

  bool receive(void* to, std::size_t size) const {
    auto* bytes = static_cast<char*>(to);
    while (size > 0) {
      if (wait_ready(fd_, POLLIN, deadline_) == 0) return false;
      const ssize_t got = ::read(fd_, bytes, size);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return false;
      bytes += got;
      size -= static_cast<std::size_t>(got);
    }
    return true;
  }

 private:
  pid_t process_;
  int fd_;
  Deadline deadline_;
};

}  // namespace

CopiesHeldOff::CopiesHeldOff() : held_(copying()) {}

Result<void> run_isolated(const std::function<void(const Send&)>& work, const std::function<void(const Receive&)>& take,
                          Duration within) {
  std::array<int, 2> fds{-1, -1};
  if (::pipe2(fds.data(), O_CLOEXEC) != 0) return Error{Errc::io, "no pipe is free for a decoder"};
  constexpr int kPipeBytes = 1 << 20;  // a volume is hundreds of megabytes
  (void)::fcntl(fds[0], F_SETPIPE_SZ, kPipeBytes);
  const pid_t child = [] {
    const std::unique_lock alone(copying());
    return ::fork();
  }();
  if (child < 0) {
    ::close(fds[0]);
    ::close(fds[1]);
    return Error{Errc::io, "no process is free for a decoder"};
  }
  if (child == 0) {
    ::close(fds[0]);
    run_copy(fds[1], work);
  }
  ::close(fds[1]);
  const Copy copy(child, fds[0], within);
  take([&copy](void* to, std::size_t size) { return copy.receive(to, size); });
  return {};
}

}  // namespace birdseye::host
