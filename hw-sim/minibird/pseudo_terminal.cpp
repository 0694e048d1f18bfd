#include "hw-sim/minibird/pseudo_terminal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <utility>

namespace birdseye::hw_sim {

Result<PseudoTerminal> PseudoTerminal::open(const std::filesystem::path& link) {
  const int ours = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
  std::array<char, 128> name{};
  if (ours < 0 || ::grantpt(ours) != 0 || ::unlockpt(ours) != 0 || ::ptsname_r(ours, name.data(), name.size()) != 0) {
    if (ours >= 0) ::close(ours);
    return Error{Errc::io, "no pseudo-terminal is free; is /dev/pts mounted?"};
  }
  const int theirs = ::open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (theirs >= 0) {
    termios raw{};
    ::tcgetattr(theirs, &raw);
    ::cfmakeraw(&raw);
    ::tcsetattr(theirs, TCSANOW, &raw);
  }
  std::error_code error;
  if (std::filesystem::is_symlink(link, error)) std::filesystem::remove(link, error);
  std::filesystem::create_symlink(name.data(), link, error);
  if (error || theirs < 0) {
    if (theirs >= 0) ::close(theirs);
    ::close(ours);
    return Error{Errc::unreadable,
                 fmt::format("{}: cannot be made a link to {}; give another --tty", link.string(), name.data())};
  }
  return PseudoTerminal(ours, theirs, link);
}

PseudoTerminal::PseudoTerminal(PseudoTerminal&& other) noexcept
    : ours_(std::exchange(other.ours_, -1)), theirs_(std::exchange(other.theirs_, -1)), link_(std::move(other.link_)) {}

PseudoTerminal::~PseudoTerminal() {
  if (ours_ < 0) return;
  ::close(ours_);
  ::close(theirs_);
  std::error_code ignored;
  std::filesystem::remove(link_, ignored);
}

std::vector<std::uint8_t> PseudoTerminal::read() {
  std::array<std::uint8_t, 256> chunk;
  const ssize_t got = ::read(ours_, chunk.data(), chunk.size());
  return got > 0 ? std::vector<std::uint8_t>(chunk.begin(), chunk.begin() + got) : std::vector<std::uint8_t>{};
}

void PseudoTerminal::write(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t put = ::write(ours_, bytes.data(), bytes.size());
    if (put > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(put));
    } else if (errno != EINTR) {
      return;
    }
  }
}

}  // namespace birdseye::hw_sim
