#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>

namespace birdseye::testing {

/// The folder of real recordings: $BIRDSEYE_DATA, or shared/data beside the checkout. Empty where neither exists:
/// the caller then says so with GTEST_SKIP.
inline std::optional<std::filesystem::path> data_dir() {
  if (const char* dir = std::getenv("BIRDSEYE_DATA"); dir != nullptr) return std::filesystem::path(dir);
  if (const char* source = std::getenv("BIRDSEYE_SOURCE_DIR"); source != nullptr) {
    std::filesystem::path beside = std::filesystem::path(source).parent_path() / "shared" / "data";
    if (std::filesystem::is_directory(beside)) return beside;
  }
  return std::nullopt;
}

}  // namespace birdseye::testing
