#include "drivers/identity/identity_folder.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

namespace birdseye {

namespace {

std::string environment(const char* name) {
  const char* const value = std::getenv(name);
  return value != nullptr ? value : "";
}

}  // namespace

Result<std::filesystem::path> identity_folder() {
  namespace fs = std::filesystem;
  if (const std::string given = environment("BIRDSEYE_IDENTITY"); !given.empty()) return fs::path(given);
  // Several folders come with colons between them.
  std::string state = environment("STATE_DIRECTORY");
  if (!state.empty()) return fs::path(state.substr(0, state.find(':'))) / "identity";
  if (const std::string config = environment("XDG_CONFIG_HOME"); !config.empty())
    return fs::path(config) / "birdseye" / "identity";
  if (const std::string home = environment("HOME"); !home.empty())
    return fs::path(home) / ".config" / "birdseye" / "identity";
  return Error{Errc::not_found,
               "there is no folder for this machine's key: HOME is not set; set BIRDSEYE_IDENTITY to a folder"};
}

Result<void> check_owner(const std::filesystem::path& path, const struct stat& status) {
  const uid_t user = ::geteuid();
  if (status.st_uid == user || status.st_uid == 0) return {};
  return Error{Errc::bad_value,
               fmt::format("{}: belongs to another user ({}), who may change the keys: start this as that user, or "
                           "look whether what is in it is yours and chown {} {}",
                           path.string(), status.st_uid, user, path.string())};
}

}  // namespace birdseye
