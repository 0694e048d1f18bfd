#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "calibration/base/result.hpp"

namespace birdseye {

/// A program that is installed, or built, beside this one.
std::string beside_us(const std::string& name);
/// A TCP port that is free now on the loopback interface.
Result<int> free_port();

/// For sockets and the names of terminals, whose paths are bounded to about a hundred bytes, which a checkout deep in a
/// tree can exceed. Removed with this object.
class RendezvousFolder {
 public:
  static Result<std::unique_ptr<RendezvousFolder>> make();
  ~RendezvousFolder();
  RendezvousFolder(const RendezvousFolder&) = delete;
  RendezvousFolder& operator=(const RendezvousFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  explicit RendezvousFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

}  // namespace birdseye
