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

namespace {

/// Where a link leads; empty of anything else.
std::filesystem::path target_of(const std::filesystem::path& link) {
  std::error_code ignored;
  return std::filesystem::read_symlink(link, ignored);
}

}  // namespace

Result<PseudoTerminal> PseudoTerminal::open(const std::filesystem::path& link) {
  std::error_code error;
  if (std::filesystem::exists(std::filesystem::symlink_status(link, error)) &&
      target_of(link).parent_path() != "/dev/pts") {
    return Error{Errc::unreadable,
                 fmt::format("{}: is in the way, and no link to a pseudo-terminal; remove it, or give another --tty",
                             link.string())};
  }
  UniqueFd ours(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK));
  std::array<char, 128> name{};
  if (!ours || ::grantpt(ours.get()) != 0 || ::unlockpt(ours.get()) != 0 ||
      ::ptsname_r(ours.get(), name.data(), name.size()) != 0) {
    return Error{Errc::io, "no pseudo-terminal is free; is /dev/pts mounted?"};
  }
  UniqueFd theirs(::open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  if (theirs) {
    termios raw{};
    ::tcgetattr(theirs.get(), &raw);
    ::cfmakeraw(&raw);
    ::tcsetattr(theirs.get(), TCSANOW, &raw);
  }
  error.clear();
  if (std::filesystem::is_symlink(link, error)) std::filesystem::remove(link, error);
  std::filesystem::create_symlink(name.data(), link, error);
  if (error || !theirs) {
    return Error{Errc::unreadable,
                 fmt::format("{}: cannot be made a link to {}; give another --tty", link.string(), name.data())};
  }
  return PseudoTerminal(std::move(ours), std::move(theirs), link, name.data());
}

PseudoTerminal::~PseudoTerminal() {
  if (!ours_) return;                     // moved from: the link is another's
  if (target_of(link_) != name_) return;  // somebody else's by now
  std::error_code ignored;
  std::filesystem::remove(link_, ignored);
}

std::vector<std::uint8_t> PseudoTerminal::read() {
  std::array<std::uint8_t, 256> chunk;
  const ssize_t got = ::read(ours_.get(), chunk.data(), chunk.size());
  return got > 0 ? std::vector<std::uint8_t>(chunk.begin(), chunk.begin() + got) : std::vector<std::uint8_t>{};
}

void PseudoTerminal::write(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t put = ::write(ours_.get(), bytes.data(), bytes.size());
    if (put > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(put));
    } else if (errno != EINTR) {
      return;
    }
  }
}

}  // namespace birdseye::hw_sim
