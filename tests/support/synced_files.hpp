#pragma once

#include <filesystem>

namespace birdseye::testing {

/// Whether this program has brought the file or folder onto the disk since forget_synced(). A test that has
/// synced_files.cpp among its sources has fsync() and fdatasync() noted, for a power cut cannot be made.
bool is_synced(const std::filesystem::path& path);
/// A new file may get the number of one that is gone, and would pass for synced.
void forget_synced();

}  // namespace birdseye::testing
