#include "drivers/system/process_copy.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <utility>

#include "drivers/system/pipe.hpp"
#include "drivers/system/reap.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye {

namespace {

constexpr Duration kEnds = Duration::from_ms(2000);  // for the system to end what was killed, or has closed its pipe

std::shared_mutex& copying() {
  static std::shared_mutex mutex;
  return mutex;
}

/// Whether this process is a copy. Its mutex above is as the fork left it, held by a thread that is not here, and it
/// needs none: it has one thread.
bool& is_copy() {
  static bool is = false;
  return is;
}

/// Whether all of them came.
bool take_from(int fd, void* to, std::size_t size) {
  auto* bytes = static_cast<char*>(to);
  while (size > 0) {
    const ssize_t got = ::read(fd, bytes, size);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    bytes += got;
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

/// All that is open but standard input, output and error, and these two; -1: none.
void close_all_but(int one, int other) {
  unsigned from = STDERR_FILENO + 1;
  for (const int kept : {std::min(one, other), std::max(one, other)}) {
    if (kept < static_cast<int>(from)) continue;
    if (static_cast<unsigned>(kept) > from) ::close_range(from, static_cast<unsigned>(kept) - 1, 0);
    from = static_cast<unsigned>(kept) + 1;
  }
  ::close_range(from, ~0U, 0);
}

/// The copy's part: never returns. from: what it is given, -1 where it does not listen.
[[noreturn]] void run_copy(int fd, int from, pid_t parent,
                           const std::function<void(const ProcessCopy::Take&, const ProcessCopy::Send&)>& work) {
  const bool of_copy = std::exchange(is_copy(), true);
  // One that listens ends when its parent does, and not by what ends or stops a program from outside; its copies do.
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    if (from >= 0) ::signal(signal, SIG_IGN);
    if (from < 0 && of_copy) ::signal(signal, SIG_DFL);
  }
  if (from < 0) {  // one that listens is told of its parent's end by nothing more to take
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(1);  // it has ended already, which no signal tells any more
  }
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  if (const int nowhere = ::open("/dev/null", O_RDWR | O_CLOEXEC); nowhere >= 0) {
    ::dup2(nowhere, STDIN_FILENO);
    ::dup2(nowhere, STDOUT_FILENO);
    ::dup2(nowhere, STDERR_FILENO);
  }
  // Links to an appliance and files that are being written are the parent's alone.
  close_all_but(fd, from);
  // What work throws must not unwind into the copied stack: the objects on it are not ours to end.
  try {
    work([from](void* to, std::size_t size) { return take_from(from, to, size); },
         [fd](const void* data, std::size_t size) {
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

CopiesHeldOff::CopiesHeldOff()
    : held_(is_copy() ? std::shared_lock<std::shared_mutex>() : std::shared_lock(copying())) {}

Result<ProcessCopy> ProcessCopy::start(const std::function<void(const Send&)>& work) {
  return start([&work](const Take&, const Send& send) { work(send); }, UniqueFd(), UniqueFd());
}

Result<ProcessCopy> ProcessCopy::start_listening(const std::function<void(const Take&, const Send&)>& work) {
  std::array<int, 2> ends{};  // a pipe whose reader has ended would end this process too, by SIGPIPE
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    return Error{Errc::io, fmt::format("no way to a process of its own: {}", std::strerror(errno))};
  return start(work, UniqueFd(ends[0]), UniqueFd(ends[1]));
}

Result<ProcessCopy> ProcessCopy::start(const std::function<void(const Take&, const Send&)>& work, UniqueFd from,
                                       UniqueFd to) {
  auto pipe = Pipe::open();
  if (!pipe) return std::move(pipe).error();
  constexpr int kPipeBytes = 1 << 20;  // a volume is hundreds of megabytes
  (void)::fcntl(pipe->out.get(), F_SETPIPE_SZ, kPipeBytes);
  (void)::fcntl(pipe->out.get(), F_SETFL, O_NONBLOCK);
  const pid_t parent = ::getpid();
  const pid_t child = [] {
    std::unique_lock alone(copying(), std::defer_lock);
    if (!is_copy()) alone.lock();
    return ::fork();
  }();
  if (child < 0) {
    return Error{Errc::io, fmt::format("no process of its own: {}; close other programs", std::strerror(errno))};
  }
  if (child == 0) {
    pipe->out = UniqueFd();
    run_copy(pipe->in.get(), from.get(), parent, work);
  }
  return ProcessCopy(child, std::move(pipe->out), std::move(to));
}

Result<void> ProcessCopy::give(const void* data, std::size_t size, Deadline deadline) {
  const auto* bytes = static_cast<const char*>(data);
  while (size > 0) {
    if (deadline.passed()) return Error{Errc::timeout, "did not take what it was given"};
    if (wait_ready(to_.get(), POLLOUT, deadline) == 0) continue;
    const ssize_t put = ::send(to_.get(), bytes, size, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (put < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (put <= 0) return ended();
    bytes += put;
    size -= static_cast<std::size_t>(put);
  }
  return {};
}

ProcessCopy::ProcessCopy(ProcessCopy&& other) noexcept
    : process_(std::exchange(other.process_, -1)),
      maker_(other.maker_),
      ended_by_(other.ended_by_),
      fd_(std::move(other.fd_)),
      to_(std::move(other.to_)) {}

ProcessCopy::~ProcessCopy() {
  // A copy that waits for room in its pipe, or for what it is given, ends by that, also where it may not be killed.
  fd_ = UniqueFd();
  to_ = UniqueFd();
  kill();
}

/// Its status; empty where it was none any more, or where the system does not end it in time: it then stays until this
/// process ends.
std::optional<int> ProcessCopy::kill() {
  if (process_ <= 0 || maker_ != ::getpid()) return std::nullopt;  // a copy of its maker has no part in it
  ::kill(process_, SIGKILL);
  return reap(std::exchange(process_, -1), Deadline::after(kEnds));
}

/// How it ended, once its pipe is closed.
Error ProcessCopy::ended() {
  auto status = process_ > 0 ? reap(process_, Deadline::after(kEnds)) : std::nullopt;
  if (!status) {
    kill();
    return {Errc::disconnected, "ended before it had sent all"};
  }
  process_ = -1;
  if (WIFSIGNALED(*status)) {
    const int signal = ended_by_ = WTERMSIG(*status);
    return {Errc::disconnected, fmt::format("ended by signal {} ({})", signal, ::strsignal(signal))};
  }
  if (WEXITSTATUS(*status) != 0) return {Errc::disconnected, "gave up"};
  return {Errc::disconnected, "ended before it had sent all"};
}

Result<void> ProcessCopy::receive(void* to, std::size_t size, Deadline deadline, const std::stop_token& stop) {
  constexpr Duration kLook = Duration::from_ms(50);
  auto* bytes = static_cast<char*>(to);
  while (size > 0) {
    // Looked at first: of a copy that sends without end, something is always ready.
    if (deadline.passed()) {
      kill();
      return Error{Errc::timeout, "was not done in time, and was ended"};
    }
    if (stop.stop_requested()) {
      kill();
      return Error{Errc::disconnected, "was called off"};
    }
    if (wait_ready(fd_.get(), POLLIN, stop.stop_possible() ? std::min(deadline, Deadline::after(kLook)) : deadline) ==
        0)
      continue;
    const ssize_t got = ::read(fd_.get(), bytes, size);
    if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (got <= 0) return ended();
    bytes += got;
    size -= static_cast<std::size_t>(got);
  }
  return {};
}

}  // namespace birdseye
