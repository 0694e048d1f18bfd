#include "host/files/files_sha256.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <system_error>
#include <vector>

#include "calibration/record/sha256.hpp"

namespace birdseye::host {

namespace fs = std::filesystem;

namespace {

Error unreadable(const fs::path& path) {
  return {Errc::unreadable, fmt::format("{}: cannot be read; check the path and its permissions", path.string())};
}

Result<std::string> file_sha256(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return unreadable(path);
  calibration::Sha256 sum;
  std::array<char, 65536> block{};
  while (in.read(block.data(), block.size()) || in.gcount() > 0)
    sum.add({reinterpret_cast<const std::uint8_t*>(block.data()), static_cast<std::size_t>(in.gcount())});
  if (in.bad()) return unreadable(path);
  return sum.hex();
}

}  // namespace

Result<std::string> files_sha256(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return file_sha256(path);
  std::vector<fs::path> files;
  for (fs::recursive_directory_iterator it(path, error), end; !error && it != end; it.increment(error)) {
    if (it->is_regular_file(error)) files.push_back(it->path());
  }
  if (error) return unreadable(path);
  std::sort(files.begin(), files.end());
  std::string listed;
  for (const fs::path& file : files) {
    const auto sum = file_sha256(file);
    if (!sum) return sum.error();
    listed += fmt::format("{} {}\n", *sum, file.lexically_relative(path).string());
  }
  return calibration::sha256_of(listed);
}

}  // namespace birdseye::host
