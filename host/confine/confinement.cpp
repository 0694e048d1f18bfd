#include "host/confine/confinement.hpp"

#include <fcntl.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <memory>

#include "drivers/system/file_access.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;

/// Lowers this process's own limit to `most` for good; one that is lower already stays.
void lower_limit(__rlimit_resource of, rlim_t most) {
  rlimit limit{};
  if (::getrlimit(of, &limit) != 0 || limit.rlim_cur <= most) return;
  limit.rlim_cur = limit.rlim_max = most;
  ::setrlimit(of, &limit);
}

/// A file may claim any size, and a deflated one grow to it: half of the machine's memory is more than any CT needs.
void bound_memory(std::uintmax_t allowed_bytes) {
  rlim_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const long all_pages = ::sysconf(_SC_PHYS_PAGES), page_bytes = ::sysconf(_SC_PAGESIZE);
  if (pages == 0 || all_pages <= 0 || page_bytes <= 0) return;
  const auto page = static_cast<rlim_t>(page_bytes);
  const rlim_t half = static_cast<rlim_t>(all_pages) / 2 * page;
  lower_limit(RLIMIT_AS, pages * page + std::min<rlim_t>(half, allowed_bytes));
}

/// From now on, up to a whole second, as the limit is: at least what is allowed.
void bound_processor_time(Duration allowed) {
  rusage used{};
  if (::getrusage(RUSAGE_SELF, &used) != 0) return;
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  // The limit counts whole ticks of the kernel's clock, and over many files they come to more than what was used.
  constexpr double kByTicks = 1.1;
  const double until_s = kByTicks * (seconds(used.ru_utime) + seconds(used.ru_stime)) + allowed.seconds();
  rlimit limit{};
  if (::getrlimit(RLIMIT_CPU, &limit) != 0) return;
  limit.rlim_cur = std::min(limit.rlim_max, static_cast<rlim_t>(std::ceil(until_s)));
  ::setrlimit(RLIMIT_CPU, &limit);
}

/// Beside the input: tables of characters and time zones, which texts of DICOM files ask for, and what the C library
/// asks of the machine.
bool bound_files(std::vector<fs::path> readable) {
  for (const char* path : {"/usr", "/etc/localtime", "/etc/ld.so.cache", "/proc/self", "/proc/cpuinfo", "/proc/meminfo",
                           "/sys/devices/system/cpu", "/dev/null", "/dev/urandom"}) {
    readable.emplace_back(path);
  }
  return leave_to_read(readable);
}

struct Released {
  void operator()(void* filter) const { seccomp_release(filter); }
};

/// Allows what a decoder does, on any machine, and nothing that opens a socket, starts a program, ends another process,
/// or writes to a file; for_files: it may open files to read, and make copies of itself, as a decoder of many files
/// does. What is not allowed fails with EPERM, as it does for a user without the right.
bool bound_system_calls(bool for_files) {
  const std::unique_ptr<void, Released> filter(seccomp_init(SCMP_ACT_ERRNO(EPERM)));
  if (filter == nullptr) return false;
  constexpr std::array kFree{
      // memory
      "brk", "mmap", "mmap2", "munmap", "mremap", "mprotect", "madvise", "membarrier",
      // files that are open, and what a name says
      "read", "readv", "pread64", "preadv", "write", "writev", "lseek", "_llseek", "close", "close_range", "dup",
      "dup2", "dup3", "fcntl", "fcntl64", "fadvise64", "fstat", "fstat64", "stat", "stat64", "lstat", "lstat64",
      "newfstatat", "fstatat64", "statx", "statfs", "fstatfs", "access", "faccessat", "faccessat2", "readlink",
      "readlinkat", "getcwd", "getdents", "getdents64", "pipe", "pipe2", "poll", "ppoll", "ppoll_time64", "select",
      "pselect6",
      // time
      "clock_gettime", "clock_gettime64", "clock_getres", "clock_nanosleep", "clock_nanosleep_time64", "gettimeofday",
      "nanosleep", "time", "times",
      // signals of its own, and threads
      "rt_sigaction", "rt_sigprocmask", "rt_sigreturn", "rt_sigtimedwait", "sigaltstack", "restart_syscall", "futex",
      "futex_time64", "set_robust_list", "rseq", "set_tid_address", "arch_prctl", "sched_yield", "sched_getaffinity",
      "getcpu", "exit", "exit_group",
      // what it is
      "getpid", "getppid", "gettid", "getuid", "geteuid", "getgid", "getegid", "getrusage", "getrlimit", "ugetrlimit",
      "setrlimit", "getrandom", "uname", "sysinfo"};
  bool holds = true;
  const auto allow = [&](const char* name, std::initializer_list<scmp_arg_cmp> when = {}) {
    const int call = seccomp_syscall_resolve_name(name);
    if (call == __NR_SCMP_ERROR) return;  // another machine's
    holds = seccomp_rule_add_array(filter.get(), SCMP_ACT_ALLOW, call, static_cast<unsigned>(when.size()),
                                   when.size() == 0 ? nullptr : when.begin()) == 0 &&
            holds;
  };
  for (const char* name : kFree) allow(name);
  constexpr scmp_datum_t kWrites = O_ACCMODE | O_CREAT | O_TRUNC | O_APPEND;
  if (for_files) {
    for (const char* name : {"fork", "vfork", "clone", "clone3", "wait4", "waitid"}) allow(name);
    allow("open", {SCMP_A1(SCMP_CMP_MASKED_EQ, kWrites, O_RDONLY)});
    allow("openat", {SCMP_A2(SCMP_CMP_MASKED_EQ, kWrites, O_RDONLY)});
  }
  if (!for_files) {
    // Threads, by clone alone: the C library takes it where a kernel has no clone3, whose flags no filter can see.
    constexpr scmp_datum_t kThread = CLONE_THREAD;
    allow("clone", {SCMP_A0(SCMP_CMP_MASKED_EQ, kThread, kThread)});
    const int newer = seccomp_syscall_resolve_name("clone3");
    holds = seccomp_rule_add(filter.get(), SCMP_ACT_ERRNO(ENOSYS), newer, 0) == 0 && holds;
  }
  // Its own limits, and its own end where an assertion fails; a copy of it ends in another way then.
  const auto self = static_cast<scmp_datum_t>(::getpid());
  allow("prlimit64", {SCMP_A0(SCMP_CMP_EQ, 0)});
  allow("tgkill", {SCMP_A0(SCMP_CMP_EQ, self)});
  allow("prctl", {SCMP_A0(SCMP_CMP_EQ, PR_SET_PDEATHSIG)});
  return holds && seccomp_load(filter.get()) == 0;
}

Confinement confine_to(const Readable& readable, bool for_files) {
  const Allowance allowance = allowance_of(readable.bytes);
  bound_memory(allowance.memory_bytes);
  bound_processor_time(allowance.processor_time);
  lower_limit(RLIMIT_FSIZE, 0);
  Confinement confinement;
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return confinement;
  confinement.files = bound_files(readable.paths);
  confinement.system_calls = bound_system_calls(for_files);
  return confinement;
}

}  // namespace

Confinement confine_to(const fs::path& input) {
  return confine_to(readable_for(input), true);
}

Confinement confine_to_bytes(std::uintmax_t bytes) {
  return confine_to(Readable{{}, bytes}, false);
}

void allow_time_for(const fs::path& file) {
  bound_processor_time(allowance_of(readable_for(file).bytes).processor_time);
}

}  // namespace birdseye::host
