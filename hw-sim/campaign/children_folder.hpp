#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "calibration/base/result.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye::hw_sim {

/// A folder for the temporary files of the programs that this program starts: as long as this object is there, TMPDIR
/// names it. The folder goes with this object, and with it what a program left that was ended from outside. What a
/// campaign left that was itself ended, the next one on the same machine removes. Make and drop this object while no
/// other thread of ours reads the environment.
class ChildrenFolder {
 public:
  /// Within the folder that TMPDIR names now, which is on this machine and has a short path: programs make sockets in
  /// such a folder, and many programs write to their own at once.
  static Result<std::unique_ptr<ChildrenFolder>> make();
  ~ChildrenFolder();
  ChildrenFolder(const ChildrenFolder&) = delete;
  ChildrenFolder& operator=(const ChildrenFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  ChildrenFolder(std::filesystem::path path, UniqueFd lock);
  std::filesystem::path path_;
  UniqueFd lock_;
  std::optional<std::string> former_;  ///< TMPDIR, where it was set
};

}  // namespace birdseye::hw_sim
