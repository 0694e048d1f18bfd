#include "device/birdseyed/record_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

#include "drivers/system/clock.hpp"
#include "drivers/system/durable.hpp"
#include "drivers/system/same_file.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye::device {

namespace {

namespace fs = std::filesystem;

constexpr int kMostOfOneName = 1000;

class DiskFile : public RecordFile {
 public:
  DiskFile(UniqueFd fd, const fs::path& path) : fd_(std::move(fd)), path_(path), folder_(path.parent_path()) {}

  int write(std::span<const std::uint8_t> bytes) override {
    while (!bytes.empty()) {
      const ssize_t put = ::write(fd_.get(), bytes.data(), bytes.size());
      if (put < 0 && errno == EINTR) continue;
      if (put <= 0) return put < 0 ? errno : ENOSPC;
      bytes = bytes.subspan(static_cast<std::size_t>(put));
    }
    return 0;
  }
  int sync() override {
    if (!has_its_name()) return ENOENT;
    if (::fdatasync(fd_.get()) != 0 && errno != EINVAL) return errno;  // EINVAL: it cannot
    // Its name with it, once: what is on the disk without a name is lost all the same.
    if (named_) return 0;
    if (!sync_folder(folder_)) return EIO;
    named_ = true;
    return 0;
  }

 private:
  /// Whoever has removed the file, or put another in its place, would not find what is written from then on. One that
  /// was moved is still there.
  [[nodiscard]] bool has_its_name() const {
    struct stat ours = {}, there = {};
    if (::fstat(fd_.get(), &ours) != 0) return true;  // which says nothing of its name
    if (ours.st_nlink == 0) return false;
    if (::lstat(path_.c_str(), &there) != 0) return true;
    return is_same_file(ours, there);
  }

  UniqueFd fd_;
  fs::path path_, folder_;
  bool named_ = false;
};

NewRecordFile signed_by_this_machine(UniqueFd fd, const fs::path& path) {
  NewRecordFile created{std::make_unique<DiskFile>(std::move(fd), path), path};
  if (auto machine = ThisMachine::open()) {
    created.machine = *std::move(machine);
  } else {  // better one that nobody signs than none
    spdlog::warn("recording: {}: not signed: {}", path.string(), machine.error().what);
  }
  return created;
}

}  // namespace

Result<NewRecordFile> create_record_file(const fs::path& folder) {
  std::string stamp = utc_now();
  std::erase_if(stamp, [](char c) { return c == '-' || c == ':'; });
  const std::string name = "birdseyed-" + stamp;
  if (auto made = make_folder_durably(folder); !made)
    return Error{Errc::unreadable, made.error().what + " ([record] folder)"};
  fs::path path = folder / (name + ".berec");
  int os_errno = EEXIST;
  for (int i = 2; os_errno == EEXIST && i <= kMostOfOneName; ++i) {
    UniqueFd fd(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0640));
    if (fd) return signed_by_this_machine(std::move(fd), path);
    os_errno = errno;
    if (os_errno == EEXIST) path = folder / fmt::format("{}-{}.berec", name, i);
  }
  return Error{Errc::unreadable, fmt::format("{}: cannot be written ({}); see [record] folder and its permissions",
                                             path.string(), std::generic_category().message(os_errno))};
}

}  // namespace birdseye::device
