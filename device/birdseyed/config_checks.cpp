#include "device/birdseyed/config_checks.hpp"

#include <fmt/format.h>
#include <sys/un.h>

#include <algorithm>
#include <cstddef>
#include <set>
#include <system_error>

#include "device/wire/igtl_bytes.hpp"

namespace birdseye::device {

namespace {

constexpr std::size_t kMostPathBytes = sizeof(sockaddr_un::sun_path) - 1;

bool is_control(unsigned char c) {
  return c < ' ' || c == 0x7F;
}

}  // namespace

std::string fault_of_bird_names(const std::vector<std::string>& names) {
  std::set<std::string> before;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string& name = names[i];
    if (name.empty()) return fmt::format("bird {} has no name", i + 1);
    if (std::ranges::any_of(name, is_control)) return fmt::format("bird {}'s name has a control character", i + 1);
    if (name.size() > wire::kMostBirdNameBytes) {
      return fmt::format("\"{}\" has {} bytes, and TDATA carries {} of a name; give a shorter one", name, name.size(),
                         wire::kMostBirdNameBytes);
    }
    // Who is told poses by name would take one of them for the other.
    if (!before.insert(name).second)
      return fmt::format("two birds are called \"{}\"; give each a name of its own", name);
  }
  return {};
}

std::string fault_of_socket(const std::string& value, const std::string& kind) {
  if (!value.starts_with(kind) || value.size() - kind.size() <= kMostPathBytes) return {};
  return fmt::format("a socket's path has at most {} bytes, and this one has {}; give a shorter one", kMostPathBytes,
                     value.size() - kind.size());
}

std::string fault_of_folder(const std::filesystem::path& folder) {
  // What is not there yet is made; what it is to be made in has to be a folder, too.
  for (std::filesystem::path path = folder; !path.empty(); path = path.parent_path()) {
    std::error_code ignored;
    const auto status = std::filesystem::status(path, ignored);
    if (std::filesystem::is_directory(status)) return {};
    if (std::filesystem::exists(status)) return fmt::format("\"{}\" is no folder; give one", path.string());
    if (path == path.parent_path()) break;
  }
  return {};
}

}  // namespace birdseye::device
