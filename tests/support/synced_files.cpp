#include "tests/support/synced_files.hpp"

#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <mutex>
#include <set>
#include <utility>

namespace birdseye::testing {

namespace {

std::mutex mutex;
std::set<std::pair<dev_t, ino_t>> synced;  // not names: files are renamed

int note(int fd, long call) {
  const auto result = static_cast<int>(::syscall(call, fd));
  struct stat file {};
  if (result != 0 || ::fstat(fd, &file) != 0) return result;
  const std::lock_guard lock(mutex);
  synced.emplace(file.st_dev, file.st_ino);
  return result;
}

}  // namespace

bool is_synced(const std::filesystem::path& path) {
  struct stat file {};
  if (::stat(path.c_str(), &file) != 0) return false;
  const std::lock_guard lock(mutex);
  return synced.contains({file.st_dev, file.st_ino});
}

void forget_synced() {
  const std::lock_guard lock(mutex);
  synced.clear();
}

}  // namespace birdseye::testing

// In place of libc's.
extern "C" int fsync(int fd) {
  return birdseye::testing::note(fd, SYS_fsync);
}
extern "C" int fdatasync(int fd) {
  return birdseye::testing::note(fd, SYS_fdatasync);
}
