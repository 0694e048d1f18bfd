#include "host/recording/output_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <vector>

#include "drivers/system/same_file.hpp"

namespace birdseye::host {

namespace fs = std::filesystem;

namespace {

Error cannot(const fs::path& path, int fault) {
  if (fault == ENOSPC || fault == EDQUOT || fault == EFBIG)
    return {Errc::io,
            fmt::format("{}: the disk has no room for more; free some, or choose another --out", path.string())};
  return {Errc::unreadable, fmt::format("{}: cannot be written: {}", path.string(), std::strerror(fault))};
}

}  // namespace

Error changed_meanwhile(const fs::path& path) {
  return {Errc::bad_format,
          fmt::format("{}: was changed or replaced by something else while it was recorded; record into a "
                      "folder that nothing else writes to",
                      path.string())};
}

Error gone_meanwhile(const fs::path& path) {
  return {Errc::not_found,
          fmt::format("{}: was removed or renamed while it was recorded; leave it where it is until record has ended",
                      path.string())};
}

Result<OutputFile> OutputFile::create(const fs::path& path) {
  UniqueFd fd(::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644));
  if (!fd && errno == EEXIST)
    return Error{Errc::unreadable, fmt::format("{}: is there already; choose another --out", path.string())};
  if (!fd) return cannot(path, errno);
  return OutputFile(std::move(fd), path);
}

Result<void> OutputFile::put(std::uint64_t at, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t put = ::pwrite(fd_.get(), bytes.data(), bytes.size(), static_cast<off_t>(at));
    if (put > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(put));
      at += static_cast<std::uint64_t>(put);
    } else if (put == 0 || errno != EINTR) {
      return cannot(path_, put == 0 ? ENOSPC : errno);
    }
  }
  return {};
}

Result<void> OutputFile::put(std::uint64_t at, const std::string& text) {
  return put(at, std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

void OutputFile::cut(std::uint64_t bytes) {
  (void)!::ftruncate(fd_.get(), static_cast<off_t>(bytes));
}

Result<void> OutputFile::read(const Take& take) const {
  std::vector<std::uint8_t> chunk(std::size_t{4} << 20U);
  for (std::uint64_t at = 0;;) {
    const ssize_t got = ::pread(fd_.get(), chunk.data(), chunk.size(), static_cast<off_t>(at));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return cannot(path_, errno);
    if (got == 0) return {};
    if (auto taken = take(std::span(chunk).first(static_cast<std::size_t>(got))); !taken) return taken;
    at += static_cast<std::uint64_t>(got);
  }
}

Result<void> OutputFile::sync() {
  if (::fsync(fd_.get()) != 0) return cannot(path_, errno);
  return {};
}

Result<void> OutputFile::check(std::uint64_t bytes) const {
  struct stat own = {}, there = {};
  if (::fstat(fd_.get(), &own) != 0) return cannot(path_, errno);
  if (::lstat(path_.c_str(), &there) != 0) return gone_meanwhile(path_);
  if (!is_same_file(own, there) || static_cast<std::uint64_t>(own.st_size) != bytes) return changed_meanwhile(path_);
  return {};
}

}  // namespace birdseye::host
