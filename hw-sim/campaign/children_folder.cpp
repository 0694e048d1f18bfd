#include "hw-sim/campaign/children_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string_view>
#include <system_error>
#include <utility>

namespace birdseye::hw_sim {

namespace {

constexpr const char* kVariable = "TMPDIR";
constexpr std::string_view kBegins = "birdseye-campaign-", kDrawn = "XXXXXX";
/// A file in each such folder, which nobody else's folder of such a name has.
constexpr const char* kMark = ".temporary-files-of-a-campaign";

/// The lock of a campaign's folder; empty where a program holds it that still runs, or where the folder is another
/// user's. Programs that this one starts inherit the lock: the folder stays for as long as one of them runs.
UniqueFd lock_of(const std::filesystem::path& folder) {
  UniqueFd fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW));
  struct stat status {};
  const bool is_ours = fd && ::fstat(fd.get(), &status) == 0 && status.st_uid == ::geteuid();
  if (!is_ours || ::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) return UniqueFd();
  return fd;
}

/// What campaigns left there whose programs have all ended.
void remove_left(const std::filesystem::path& within) {
  std::error_code failed;
  for (std::filesystem::directory_iterator entry(within, failed), end; !failed && entry != end;
       entry.increment(failed)) {
    const std::string name = entry->path().filename().string();
    std::error_code ignored;
    if (!name.starts_with(kBegins) || name.size() != kBegins.size() + kDrawn.size() ||
        !std::filesystem::is_regular_file(std::filesystem::symlink_status(entry->path() / kMark, ignored)))
      continue;
    if (const UniqueFd lock = lock_of(entry->path())) std::filesystem::remove_all(entry->path(), ignored);
  }
}

}  // namespace

Result<std::unique_ptr<ChildrenFolder>> ChildrenFolder::make() {
  std::error_code failed;
  const std::filesystem::path within = std::filesystem::absolute(std::filesystem::temp_directory_path(failed), failed);
  if (failed) {
    return Error{
        Errc::not_found,
        "there is no folder for temporary files (TMPDIR or, where it is not set, /tmp); set TMPDIR to a folder "
        "with room"};
  }
  remove_left(within);
  constexpr int kTries = 10;
  for (int i = 0; i < kTries; ++i) {
    std::string path = fmt::format("{}{}", (within / kBegins).string(), kDrawn);
    if (::mkdtemp(path.data()) == nullptr) {
      return Error{Errc::unreadable,
                   fmt::format("{}: cannot be made ({}); set TMPDIR to a folder with room", path, ::strerror(errno))};
    }
    // Marked once it is locked: another campaign that begins just now takes it for none that was left.
    UniqueFd lock = lock_of(path);
    const UniqueFd mark(
        ::open((std::filesystem::path(path) / kMark).c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
    if (lock && mark) return std::unique_ptr<ChildrenFolder>(new ChildrenFolder(path, std::move(lock)));
    if (mark) std::filesystem::remove(std::filesystem::path(path) / kMark, failed);
    ::rmdir(path.c_str());
  }
  return Error{Errc::io, fmt::format("{}: no folder there can be locked; set TMPDIR to a folder of this machine's disk",
                                     within.string())};
}

ChildrenFolder::ChildrenFolder(std::filesystem::path path, UniqueFd lock)
    : path_(std::move(path)), lock_(std::move(lock)) {
  if (const char* const former = ::getenv(kVariable); former != nullptr) former_ = former;
  ::setenv(kVariable, path_.c_str(), 1);
}

ChildrenFolder::~ChildrenFolder() {
  former_ ? ::setenv(kVariable, former_->c_str(), 1) : ::unsetenv(kVariable);
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace birdseye::hw_sim
