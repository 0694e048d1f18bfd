#include "host/confine/confinement.hpp"

#include <fcntl.h>
#include <sched.h>
#include <seccomp.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "drivers/system/file_access.hpp"
#include "drivers/system/fixed_limits.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

Error unconfined(const std::string& what, int error, const char* remedy) {
  return {Errc::io, "its decoder cannot be confined: " + what + " (" + std::strerror(error) + "); " + remedy};
}

Error unbounded(const char* what) {
  return unconfined(std::string("the system does not bound its ") + what, errno,
                    "start birdseye outside of the container or sandbox that forbids it");
}

Error unfiltered(int error) {
  return unconfined("there is no filter of its system calls, seccomp", error,
                    "run a kernel that has seccomp filters, as Debian's, and let a container use them");
}

/// Lowers this process's own limit to `most` for good; one that is lower already stays.
bool lower_limit(__rlimit_resource of, rlim_t most) {
  rlimit limit{};
  if (::getrlimit(of, &limit) != 0) return false;
  const rlimit lowered{std::min(limit.rlim_cur, most), std::min(limit.rlim_max, most)};
  return ::setrlimit(of, &lowered) == 0;
}

/// A file may claim any size, and a deflated one grow to it: half of the machine's memory is more than any CT needs.
bool bound_memory(std::uintmax_t allowed_bytes) {
  rlim_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const long all_pages = ::sysconf(_SC_PHYS_PAGES), page_bytes = ::sysconf(_SC_PAGESIZE);
  if (pages == 0 || all_pages <= 0 || page_bytes <= 0) {
    errno = ENOENT;  // there is no /proc
    return false;
  }
  const auto page = static_cast<rlim_t>(page_bytes);
  const rlim_t half = static_cast<rlim_t>(all_pages) / 2 * page;
  return lower_limit(RLIMIT_AS, pages * page + std::min<rlim_t>(half, allowed_bytes));
}

/// From now on, up to a whole second, as the limit is: at least what is allowed, and what is allowed in all, once that
/// is bounded. A process that ignores the signal of the first limit is killed two seconds later, at the second.
bool bound_processor_time(Duration allowed, std::optional<Duration> in_all) {
  constexpr rlim_t kHeed_s = 2;
  rusage used{};
  rlimit limit{};
  if (::getrusage(RUSAGE_SELF, &used) != 0 || ::getrlimit(RLIMIT_CPU, &limit) != 0) return false;
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  // The limit counts whole ticks of the kernel's clock, and over many files they come to more than what was used.
  constexpr double kByTicks = 1.1;
  const double used_s = kByTicks * (seconds(used.ru_utime) + seconds(used.ru_stime));
  const auto until_s = [used_s](Duration more) { return static_cast<rlim_t>(std::ceil(used_s + more.seconds())); };
  if (in_all) limit.rlim_max = std::min(limit.rlim_max, until_s(*in_all) + kHeed_s);
  limit.rlim_cur = std::min(until_s(allowed), limit.rlim_max > kHeed_s ? limit.rlim_max - kHeed_s : limit.rlim_max);
  return ::setrlimit(RLIMIT_CPU, &limit) == 0;
}

/// Beside the input: tables of characters and time zones, which texts of DICOM files ask for, and what the C library
/// asks of the machine.
bool bound_files(const Readable& readable) {
  const std::array<fs::path, 9> system{"/usr",          "/etc/localtime", "/etc/ld.so.cache",        "/proc/self",
                                       "/proc/cpuinfo", "/proc/meminfo",  "/sys/devices/system/cpu", "/dev/null",
                                       "/dev/urandom"};
  const auto listed = readable.listed.empty() ? std::span<const fs::path>() : std::span(&readable.listed, 1);
  return leave_to_read({.files = readable.files, .listed = listed, .whole = system});
}

struct Released {
  void operator()(void* filter) const { seccomp_release(filter); }
};

/// Allows what a decoder does, on any machine, and nothing that opens a socket, starts a program, copies or ends a
/// process, raises a limit, or writes to a file; for_files: it may open files to read, name the time that each takes,
/// and work with copies that it has made. What is not allowed fails with EPERM, as it does for a user without the
/// right.
Result<void> bound_system_calls(bool for_files) {
  const std::unique_ptr<void, Released> filter(seccomp_init(SCMP_ACT_ERRNO(EPERM)));
  if (filter == nullptr) return unfiltered(ENOMEM);
  (void)seccomp_attr_set(filter.get(), SCMP_FLTATR_API_SYSRAWRC, 1);  // what the kernel says, where it refuses
  constexpr std::array kFree{
      // memory
      "brk", "mmap", "mmap2", "munmap", "mremap", "mprotect", "madvise", "membarrier",
      // files that are open, and what a name says
      "read", "readv", "pread64", "preadv", "write", "writev", "lseek", "_llseek", "close", "close_range", "dup",
      "dup2", "dup3", "fadvise64", "fstat", "fstat64", "stat", "stat64", "lstat", "lstat64", "newfstatat", "fstatat64",
      "statx", "statfs", "fstatfs", "access", "faccessat", "faccessat2", "readlink", "readlinkat", "getcwd", "getdents",
      "getdents64", "pipe", "pipe2", "poll", "ppoll", "ppoll_time64", "select", "pselect6",
      // time
      "clock_gettime", "clock_gettime64", "clock_getres", "clock_nanosleep", "clock_nanosleep_time64", "gettimeofday",
      "nanosleep", "time", "times",
      // signals of its own, and threads
      "rt_sigaction", "rt_sigprocmask", "rt_sigreturn", "rt_sigtimedwait", "sigaltstack", "restart_syscall", "futex",
      "futex_time64", "set_robust_list", "rseq", "set_tid_address", "arch_prctl", "sched_yield", "sched_getaffinity",
      "getcpu", "exit", "exit_group",
      // what it is
      "getpid", "getppid", "gettid", "getuid", "geteuid", "getgid", "getegid", "getrusage", "getrlimit", "ugetrlimit",
      "getrandom", "uname", "sysinfo"};
  int failed = 0;
  const auto allow = [&](const char* name, std::initializer_list<scmp_arg_cmp> when = {}) {
    const int call = seccomp_syscall_resolve_name(name);
    if (call == __NR_SCMP_ERROR) return;  // another machine's
    const int added = seccomp_rule_add_array(filter.get(), SCMP_ACT_ALLOW, call, static_cast<unsigned>(when.size()),
                                             when.size() == 0 ? nullptr : when.begin());
    if (added != 0) failed = -added;
  };
  for (const char* name : kFree) allow(name);
  // Not to name another process, which signals of its files would then go to. The kernel reads 32 bits.
  constexpr scmp_datum_t kCommand = 0xFFFF'FFFF;
  for (const int command : {F_DUPFD, F_DUPFD_CLOEXEC, F_GETFD, F_SETFD, F_GETFL, F_SETFL, F_GETLK, F_SETLK, F_SETLKW,
                            F_GETPIPE_SZ, F_SETPIPE_SZ}) {
    for (const char* name : {"fcntl", "fcntl64"})
      allow(name, {SCMP_A1(SCMP_CMP_MASKED_EQ, kCommand, static_cast<scmp_datum_t>(command))});
  }
  constexpr scmp_datum_t kWrites = O_ACCMODE | O_CREAT | O_TRUNC | O_APPEND;
  if (for_files) {
    for (const char* name : {"wait4", "waitid"}) allow(name);
    allow("open", {SCMP_A1(SCMP_CMP_MASKED_EQ, kWrites, O_RDONLY)});
    allow("openat", {SCMP_A2(SCMP_CMP_MASKED_EQ, kWrites, O_RDONLY)});
    allow("sendto", {SCMP_A4(SCMP_CMP_EQ, 0)});  // to a copy: no address, but what the socket is connected to
    // Its next file's time: the limit that kills it is never raised by this.
    allow("prlimit64", {SCMP_A0(SCMP_CMP_EQ, 0), SCMP_A1(SCMP_CMP_EQ, RLIMIT_CPU)});
  }
  // Threads, by clone alone: the C library takes it where a kernel has no clone3, whose flags no filter can see.
  // Without this flag it makes a process, whose processor time would be counted from 0.
  constexpr scmp_datum_t kThread = CLONE_THREAD;
  allow("clone", {SCMP_A0(SCMP_CMP_MASKED_EQ, kThread, kThread)});
  const int newer = seccomp_syscall_resolve_name("clone3");
  if (const int added = seccomp_rule_add(filter.get(), SCMP_ACT_ERRNO(ENOSYS), newer, 0); added != 0) failed = -added;
  // To know its limits, as the C library does of a thread's stack, and its own end where an assertion fails.
  const auto self = static_cast<scmp_datum_t>(::getpid());
  allow("prlimit64", {SCMP_A0(SCMP_CMP_EQ, 0), SCMP_A2(SCMP_CMP_EQ, 0)});
  allow("tgkill", {SCMP_A0(SCMP_CMP_EQ, self)});
  if (failed == 0) failed = -seccomp_load(filter.get());
  if (failed != 0) return unfiltered(failed);
  return {};
}

/// Its limits, and that it gains no rights by another program.
Result<void> bound_itself(const Readable& readable) {
  const Allowance allowance = allowance_of(readable.bytes);
  if (!bound_memory(allowance.memory_bytes)) return unbounded("memory");
  if (!bound_processor_time(allowance.processor_time, readable.processor_time)) return unbounded("processor time");
  if (!lower_limit(RLIMIT_FSIZE, 0)) return unbounded("files");
  if (!fix_limits()) return unbounded("right to raise its limits");
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return unfiltered(errno);
  return {};
}

/// What this process is confined to, which it could not list any more.
struct Input {
  fs::path path;
  Duration processor_time;

  static Input& here() {
    static Input input;
    return input;
  }
};

}  // namespace

Result<Confinement> confine_to(const fs::path& input, const std::function<void()>& before_last) {
  const auto readable = readable_for(input);
  if (!readable) return readable.error();
  if (const auto bounded = bound_itself(*readable); !bounded) return bounded.error();
  Input::here() = {input, allowance_of(readable->bytes).processor_time};
  const Confinement confinement{bound_files(*readable)};
  if (before_last) before_last();
  if (const auto filtered = bound_system_calls(true); !filtered) return filtered.error();
  return confinement;
}

Result<void> confine_copy() {
  (void)::prctl(PR_SET_PDEATHSIG, SIGKILL);  // where it ended before, the copy is given nothing more
  return bound_system_calls(true);
}

Result<void> confine_to_bytes(std::uintmax_t bytes) {
  const Readable readable{{}, {}, bytes, allowance_of(bytes).processor_time};
  if (auto bounded = bound_itself(readable); !bounded) return bounded;
  (void)bound_files(readable);  // the filter lets it open none
  return bound_system_calls(false);
}

void allow_time_for(const fs::path& file) {
  const Input& input = Input::here();
  std::error_code failed;
  const std::uintmax_t bytes = file == input.path ? 0 : fs::file_size(file, failed);
  const Duration allowed = file == input.path ? input.processor_time : allowance_of(failed ? 0 : bytes).processor_time;
  (void)bound_processor_time(allowed, std::nullopt);  // where it cannot, what was allowed before holds
}

}  // namespace birdseye::host
