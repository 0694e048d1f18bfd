#pragma once

#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

namespace birdseye::testing {

/// A system call that is refused.
struct RefusedCall {
  long call = 0;
  int argument = -1;        ///< which of its arguments decides; -1: it is refused whatever they are
  std::uint32_t value = 0;  ///< it is refused where the argument is this,
  bool unless = false;      ///< or where it is not
};

/// From now on this process and the copies that it makes are as on a kernel without these calls: each fails with the
/// error. False: this kernel has no filters.
inline bool refuse_calls(std::initializer_list<RefusedCall> refused, int error) {
  constexpr std::uint16_t kLoad = BPF_LD | BPF_W | BPF_ABS, kIfEqual = BPF_JMP | BPF_JEQ | BPF_K, kReturn = BPF_RET;
  std::vector<sock_filter> program;
  for (const RefusedCall& one : refused) {
    const bool decides = one.argument >= 0;
    program.push_back({kLoad, 0, 0, offsetof(seccomp_data, nr)});
    program.push_back({kIfEqual, 0, static_cast<std::uint8_t>(decides ? 3 : 1), static_cast<std::uint32_t>(one.call)});
    if (decides) {
      const auto at = offsetof(seccomp_data, args) + sizeof(std::uint64_t) * static_cast<std::size_t>(one.argument);
      program.push_back({kLoad, 0, 0, static_cast<std::uint32_t>(at)});  // its lower half
      program.push_back({kIfEqual, static_cast<std::uint8_t>(one.unless ? 1 : 0),
                         static_cast<std::uint8_t>(one.unless ? 0 : 1), one.value});
    }
    program.push_back({kReturn, 0, 0, SECCOMP_RET_ERRNO | static_cast<std::uint32_t>(error)});
  }
  program.push_back({kReturn, 0, 0, SECCOMP_RET_ALLOW});
  const sock_fprog all{static_cast<std::uint16_t>(program.size()), program.data()};
  return ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &all) == 0;
}

}  // namespace birdseye::testing
