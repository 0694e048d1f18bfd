#pragma once

#include <filesystem>
#include <string>

namespace birdseye::testing {

/// Where our programs lie: beside this test. Asked of the system, so that a test compiles to the same in every clone.
inline std::string programs_folder() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path().string();
}

}  // namespace birdseye::testing
