#include "drivers/system/file_access.hpp"

#include <fcntl.h>
#include <linux/landlock.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdint>

#include "drivers/system/unique_fd.hpp"

namespace birdseye {

namespace {

namespace fs = std::filesystem;

/// All that the first version of Landlock knows: to run, to write, to make and to remove.
constexpr std::uint64_t kHandled = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1U) - 1;

enum class LeftAs { file, listed, whole };

/// A rule on a folder is for all that is below it, so a folder whose files have rules of their own gets no more than
/// the right to be listed. 0: it is left nothing, as it is not there, or not what it is left as.
std::uint64_t access_of(int at, LeftAs left) {
  struct stat found {};
  if (::fstat(at, &found) != 0) return 0;
  const bool is_folder = S_ISDIR(found.st_mode);
  switch (left) {
    case LeftAs::file:
      return S_ISREG(found.st_mode) ? LANDLOCK_ACCESS_FS_READ_FILE : 0;
    case LeftAs::listed:
      return is_folder ? LANDLOCK_ACCESS_FS_READ_DIR : 0;
    case LeftAs::whole:
      break;
  }
  return is_folder ? LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR : LANDLOCK_ACCESS_FS_READ_FILE;
}

/// What is not there is not read, and what has no rule neither.
void let_read(int rules, std::span<const fs::path> paths, LeftAs left) {
  for (const fs::path& path : paths) {
    const UniqueFd at(::open(path.c_str(), O_PATH | O_CLOEXEC));
    if (!at) continue;
    landlock_path_beneath_attr rule{};
    rule.allowed_access = access_of(at.get(), left);
    rule.parent_fd = at.get();
    if (rule.allowed_access != 0) ::syscall(SYS_landlock_add_rule, rules, LANDLOCK_RULE_PATH_BENEATH, &rule, 0);
  }
}

}  // namespace

bool leave_to_read(const LeftToRead& left) {
  landlock_ruleset_attr handled{};
  handled.handled_access_fs = kHandled;
  const UniqueFd rules(
      static_cast<int>(::syscall(SYS_landlock_create_ruleset, &handled, sizeof handled.handled_access_fs, 0)));
  if (!rules) return false;
  let_read(rules.get(), left.files, LeftAs::file);
  let_read(rules.get(), left.listed, LeftAs::listed);
  let_read(rules.get(), left.whole, LeftAs::whole);
  return ::syscall(SYS_landlock_restrict_self, rules.get(), 0) == 0;
}

}  // namespace birdseye
