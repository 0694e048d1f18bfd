#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// A case that `birdseye-sim case` has written into a folder of its own, which goes with this.
class SimulatorCase {
 public:
  /// Runs the program that lies beside ours. options: of `birdseye-sim case`, but for --out. Errc::bad_value, with the
  /// simulator's words, for what it refuses; Errc::timeout where it is not done in ten minutes, and Errc::unreadable
  /// where it ends in another way.
  static Result<SimulatorCase> make(const std::vector<std::string>& options);
  SimulatorCase(SimulatorCase&& other) noexcept : scratch_(std::move(other.scratch_)) { other.scratch_.clear(); }
  SimulatorCase& operator=(SimulatorCase&&) = delete;
  ~SimulatorCase();

  [[nodiscard]] std::filesystem::path folder() const { return scratch_ / "case"; }

 private:
  explicit SimulatorCase(std::filesystem::path scratch) : scratch_(std::move(scratch)) {}

  std::filesystem::path scratch_;
};

}  // namespace birdseye::host
