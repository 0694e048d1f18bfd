#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <utility>
#include <vector>

#include "calibration/base/result.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye::hw_sim {

/// The instrument's end of a pseudo-terminal; the other end is what a driver opens, under the name of a symbolic link
/// that goes away with this object.
class PseudoTerminal {
 public:
  /// A link that another left there is replaced. Whatever else is there is refused.
  static Result<PseudoTerminal> open(const std::filesystem::path& link);
  PseudoTerminal(PseudoTerminal&&) noexcept = default;
  PseudoTerminal& operator=(PseudoTerminal&&) = delete;
  ~PseudoTerminal();

  /// What the host has sent by now, without waiting.
  std::vector<std::uint8_t> read();
  /// Sends bytes; what the terminal's buffer cannot take is lost, as on a real line with nobody listening.
  void write(std::span<const std::uint8_t> bytes);
  /// For poll(): readable when the host has sent something.
  [[nodiscard]] int fd() const { return ours_.get(); }

 private:
  PseudoTerminal(UniqueFd ours, UniqueFd theirs, std::filesystem::path link, std::filesystem::path name)
      : ours_(std::move(ours)), theirs_(std::move(theirs)), link_(std::move(link)), name_(std::move(name)) {}

  UniqueFd ours_;
  UniqueFd theirs_;  ///< held open so that our end does not hang up between two drivers
  std::filesystem::path link_;
  std::filesystem::path name_;  ///< where the link leads
};

}  // namespace birdseye::hw_sim
