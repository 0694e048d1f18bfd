#pragma once

#include <filesystem>
#include <span>

namespace birdseye {

/// What a process may still open, and only to read.
struct LeftToRead {
  std::span<const std::filesystem::path> files;   ///< regular files
  std::span<const std::filesystem::path> listed;  ///< folders: the names in them and in all folders below, and no file
  std::span<const std::filesystem::path> whole;   ///< folders with all that is in them, and devices
};

/// Leaves this process, and the copies that it makes, nothing else to open for good. What is open stays open. False:
/// the kernel has no Landlock, or this process may still gain rights (PR_SET_NO_NEW_PRIVS), and nothing has changed.
bool leave_to_read(const LeftToRead& left);

}  // namespace birdseye
