#pragma once

#include <filesystem>
#include <span>

namespace birdseye {

/// Leaves this process, and the copies that it makes, nothing to open for good but these files, and the folders among
/// them with all that is in them, and those to read. What is open stays open. False: the kernel has no Landlock, or
/// this process may still gain rights (PR_SET_NO_NEW_PRIVS), and nothing has changed.
bool leave_to_read(std::span<const std::filesystem::path> paths);

}  // namespace birdseye
