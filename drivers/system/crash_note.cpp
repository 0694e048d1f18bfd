#include "drivers/system/crash_note.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>

#include "drivers/system/time_keeper.hpp"
#include "drivers/system/whole_file.hpp"

namespace birdseye {

namespace {

constinit thread_local const char* part_at_work = nullptr;
constinit std::atomic<int> note_fd = -1;

/// In a signal handler: calls nothing that may not be called there.
void replace_note(const char* text, std::size_t size) {
  const int fd = note_fd;
  if (fd < 0) return;
  (void)!::ftruncate(fd, 0);
  (void)!::pwrite(fd, text, size, 0);
}

/// The signal's effect is the default one again by now, and it is blocked until this returns.
void note_crash(int number, siginfo_t* info, void*) {
  const char* const part = part_at_work;
  if (info->si_code != SI_USER && part != nullptr) replace_note(part, ::strlen(part));
  ::raise(number);
}

}  // namespace

void name_this_thread(const char* name) {
  if (TimeKeeper::present() != nullptr) return;  // many share one thread
  ::pthread_setname_np(::pthread_self(), name);
  at_work_on(name);
}

void at_work_on(const char* part) {
  part_at_work = part;
}

Result<void> CrashNote::keep_in(const std::filesystem::path& file) {
  // Neither a pipe, which nobody may ever read, is waited for, nor what a link leads to emptied.
  const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC, 0600);
  int failed = fd < 0 ? errno : 0;
  struct stat status {};
  if (fd >= 0 && ::fstat(fd, &status) != 0) failed = errno;
  const bool other =
      fd >= 0 ? failed == 0 && !S_ISREG(status.st_mode) : failed == ELOOP || failed == ENXIO || failed == EISDIR;
  if (fd >= 0 && failed == 0 && !other && ::ftruncate(fd, 0) != 0) failed = errno;
  if (fd >= 0 && (other || failed != 0)) ::close(fd);
  if (other) {
    return Error{Errc::bad_value,
                 fmt::format("{}: is no file but a link, a pipe, a folder or a device; remove it", file.string())};
  }
  if (failed != 0)
    return Error{Errc::io, fmt::format("{}: cannot be written ({})", file.string(), std::strerror(failed))};
  if (const int former = note_fd.exchange(fd); former >= 0) ::close(former);
  struct sigaction action {};
  action.sa_sigaction = note_crash;
  action.sa_flags = SA_SIGINFO | static_cast<int>(SA_RESETHAND);
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) ::sigaction(number, &action, nullptr);
  return {};
}

void CrashNote::write(const std::string& part) {
  replace_note(part.data(), part.size());
}

std::string CrashNote::read(const std::filesystem::path& file) {
  constexpr std::size_t kMostBytes = 64;  // longer than any name
  const auto text = read_whole_file(file, kMostBytes);
  return text ? *text : std::string();
}

}  // namespace birdseye
