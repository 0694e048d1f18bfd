#include "drivers/system/whole_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace birdseye {

namespace {

constexpr std::size_t kBlockBytes = 64U << 10U;

Error unreadable(const std::filesystem::path& path) {
  return {Errc::unreadable,
          fmt::format("{}: cannot be read ({}); check its owner and permissions", path.string(), std::strerror(errno))};
}

}  // namespace

Result<UniqueFd> open_file(const std::filesystem::path& path) {
  // O_NONBLOCK: a pipe that nobody writes to is opened at once, to be refused; of a file it means nothing.
  UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (!fd && (errno == ENOENT || errno == ENOTDIR))
    return Error{Errc::not_found, fmt::format("{}: no such file", path.string())};
  struct stat status {};
  if (fd && ::fstat(fd.get(), &status) != 0) return unreadable(path);
  if ((fd && !S_ISREG(status.st_mode)) || (!fd && errno == ENXIO)) {
    const char* const what = S_ISDIR(status.st_mode) ? "a folder" : "a pipe, a socket or a device";
    return Error{Errc::bad_value,
                 fmt::format("{}: is no file but {}; give a file, or a copy in one", path.string(), what)};
  }
  if (!fd) return unreadable(path);
  return fd;
}

Result<std::string> read_whole_file(const std::filesystem::path& path, std::size_t most_bytes) {
  const auto fd = open_file(path);
  if (!fd) return fd.error();
  std::string text;
  for (std::size_t size = 0;; text.resize(size)) {
    text.resize(size + kBlockBytes);
    const ssize_t got = ::read(fd->get(), text.data() + size, kBlockBytes);
    if (got < 0 && errno != EINTR) return unreadable(path);
    size += static_cast<std::size_t>(std::max<ssize_t>(got, 0));
    if (size > most_bytes) {
      return Error{Errc::unsupported, fmt::format("{}: is larger than {} bytes, which such a file never is; see "
                                                  "whether it is the one that is meant",
                                                  path.string(), most_bytes)};
    }
    if (got == 0) {
      text.resize(size);
      return text;
    }
  }
}

}  // namespace birdseye
