#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::hw_sim {

/// The instrument's end of a pseudo-terminal; the other end is what a driver opens, under the name of a symbolic link
/// that goes away with this object.
class PseudoTerminal {
 public:
  static Result<PseudoTerminal> open(const std::filesystem::path& link);
  PseudoTerminal(PseudoTerminal&& other) noexcept;
  PseudoTerminal& operator=(PseudoTerminal&&) = delete;
  ~PseudoTerminal();

  /// What the host has sent by now, without waiting.
  std::vector<std::uint8_t> read();
  /// Sends bytes; what the terminal's buffer cannot take is lost, as on a real line with nobody listening.
  void write(std::span<const std::uint8_t> bytes);
  /// For poll(): readable when the host has sent something.
  [[nodiscard]] int fd() const { return ours_; }

 private:
  PseudoTerminal(int ours, int theirs, std::filesystem::path link)
      : ours_(ours), theirs_(theirs), link_(std::move(link)) {}

  int ours_;
  int theirs_;  ///< held open so that our end does not hang up between two drivers
  std::filesystem::path link_;
};

}  // namespace birdseye::hw_sim
