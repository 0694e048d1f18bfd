#include "drivers/system/fixed_limits.hpp"

#include <linux/capability.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cstdint>

namespace birdseye {

bool fix_limits() {
  constexpr std::uint32_t kRight = 1U << CAP_SYS_RESOURCE;  // in the first of two words of 32 rights
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  std::array<__user_cap_data_struct, _LINUX_CAPABILITY_U32S_3> rights{};
  if (::syscall(SYS_capget, &header, rights.data()) != 0) return false;
  if ((rights[0].permitted & kRight) == 0) return true;
  rights[0].effective &= ~kRight;
  rights[0].permitted &= ~kRight;
  rights[0].inheritable &= ~kRight;
  return ::syscall(SYS_capset, &header, rights.data()) == 0;
}

}  // namespace birdseye
