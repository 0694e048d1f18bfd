#include "drivers/system/file_access.hpp"

#include <fcntl.h>
#include <linux/landlock.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdint>
#include <system_error>

#include "drivers/system/unique_fd.hpp"

namespace birdseye {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kReads = LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
/// All that the first version of Landlock knows: to run, to write, to make and to remove.
constexpr std::uint64_t kHandled = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1U) - 1;

/// What is not there is not read.
void let_read(int rules, const fs::path& path) {
  const UniqueFd at(::open(path.c_str(), O_PATH | O_CLOEXEC));
  if (!at) return;
  std::error_code failed;
  landlock_path_beneath_attr rule{};
  rule.allowed_access = fs::is_directory(path, failed) ? kReads : std::uint64_t{LANDLOCK_ACCESS_FS_READ_FILE};
  rule.parent_fd = at.get();
  ::syscall(SYS_landlock_add_rule, rules, LANDLOCK_RULE_PATH_BENEATH, &rule, 0);
}

}  // namespace

bool leave_to_read(std::span<const fs::path> paths) {
  landlock_ruleset_attr handled{};
  handled.handled_access_fs = kHandled;
  const UniqueFd rules(
      static_cast<int>(::syscall(SYS_landlock_create_ruleset, &handled, sizeof handled.handled_access_fs, 0)));
  if (!rules) return false;
  for (const fs::path& path : paths) let_read(rules.get(), path);
  return ::syscall(SYS_landlock_restrict_self, rules.get(), 0) == 0;
}

}  // namespace birdseye
