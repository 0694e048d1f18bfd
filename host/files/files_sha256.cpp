#include "host/files/files_sha256.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <system_error>
#include <vector>

#include "calibration/record/sha256.hpp"
#include "drivers/system/json_file.hpp"
#include "drivers/system/whole_file.hpp"

namespace birdseye::host {

namespace fs = std::filesystem;

namespace {

Error unreadable(const fs::path& path) {
  return {Errc::unreadable, fmt::format("{}: cannot be read; check the path and its permissions", path.string())};
}

Result<std::string> file_sha256(const fs::path& path) {
  const auto fd = open_file(path);
  if (!fd) return fd.error();
  calibration::Sha256 sum;
  std::array<std::uint8_t, 65536> block{};
  for (;;) {
    const ssize_t got = ::read(fd->get(), block.data(), block.size());
    if (got == 0) return sum.hex();
    if (got < 0 && errno != EINTR) return unreadable(path);
    if (got > 0) sum.add(std::span(block).first(static_cast<std::size_t>(got)));
  }
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

Result<void> check_against_sheet(const fs::path& path) {
  constexpr std::size_t kMostSheetBytes = 1U << 20U;
  const fs::path sheet = path.parent_path() / "result.json";
  auto json = read_json_file(sheet, kMostSheetBytes);
  if (!json && json.error().code == Errc::not_found) return {};
  if (!json) {
    return Error{
        json.error().code,
        fmt::format("{}: whether it is as it was written cannot be told: {}, or move that away if it is not of "
                    "this file",
                    path.string(), json.error().what)};
  }
  const std::string name = path.filename().string();
  const nlohmann::json sums = json->is_object() ? json->value("sha256", nlohmann::json()) : nlohmann::json();
  if (!sums.contains(name)) return {};
  const auto sum = files_sha256(path);
  if (!sum) return sum.error();
  if (sums[name] == *sum) return {};
  return Error{Errc::bad_format, fmt::format("{}: is not the file of which {} tells: it was changed since, or is of "
                                             "another registration; register again",
                                             path.string(), sheet.string())};
}

}  // namespace birdseye::host
