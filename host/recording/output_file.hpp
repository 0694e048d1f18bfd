#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <utility>

#include "calibration/base/result.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye::host {

/// A file that is written to its end, whole or with an error that says so; move-only. It is open all the while,
/// whatever becomes of its name.
class OutputFile {
 public:
  /// Of that name there is nothing yet: what is another's is not emptied, and no link is followed.
  static Result<OutputFile> create(const std::filesystem::path& path);

  /// All of bytes at that place, or what was there before it and why.
  Result<void> put(std::uint64_t at, std::span<const std::uint8_t> bytes);
  Result<void> put(std::uint64_t at, const std::string& text);
  void cut(std::uint64_t bytes);
  /// Gives what is in it, from its beginning on, piece by piece.
  using Take = std::function<Result<void>(std::span<const std::uint8_t>)>;
  Result<void> read(const Take& take) const;
  /// Brings what was written onto the disk, so that it is there whatever happens next.
  Result<void> sync();
  /// Refuses where there is no file under its name any more, another one, or one with more or fewer than these bytes:
  /// somebody else was at it.
  [[nodiscard]] Result<void> check(std::uint64_t bytes) const;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  OutputFile(UniqueFd fd, std::filesystem::path path) : fd_(std::move(fd)), path_(std::move(path)) {}
  UniqueFd fd_;
  std::filesystem::path path_;
};

/// That a file is not as the recording wrote it.
Error changed_meanwhile(const std::filesystem::path& path);
/// That it, or the folder, is not there any more.
Error gone_meanwhile(const std::filesystem::path& path);

}  // namespace birdseye::host
