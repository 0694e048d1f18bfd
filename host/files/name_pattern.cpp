#include "host/files/name_pattern.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/files/name_order.hpp"

namespace birdseye::host {

namespace fs = std::filesystem;

bool is_pattern(std::string_view name) {
  return name.find_first_of("*?") != std::string_view::npos;
}

bool matches(std::string_view name, std::string_view pattern) {
  // Where the latest * was, and up to where it has swallowed the name: only that one ever has to give way.
  std::size_t at = 0, in = 0, star = std::string_view::npos, swallowed = 0;
  while (at < name.size()) {
    if (in < pattern.size() && pattern[in] == '*') {
      star = in++;
      swallowed = at;
    } else if (in < pattern.size() && (pattern[in] == '?' || pattern[in] == name[at])) {
      ++in, ++at;
    } else if (star != std::string_view::npos) {
      in = star + 1;
      at = ++swallowed;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', in) == std::string_view::npos;
}

Result<std::vector<fs::path>> files_matching(const fs::path& folder, std::string_view pattern) {
  std::vector<fs::path> files;
  std::error_code failed;
  for (fs::directory_iterator at(folder, failed); !failed && at != fs::directory_iterator(); at.increment(failed)) {
    if (matches(at->path().filename().string(), pattern)) files.push_back(at->path());
  }
  if (failed) return Error{Errc::unreadable, fmt::format("{}: cannot be read as a folder", folder.string())};
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return before_by_number(a.filename().string(), b.filename().string());
  });
  return files;
}

}  // namespace birdseye::host
