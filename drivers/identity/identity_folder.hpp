#pragma once

#include <sys/stat.h>

#include <filesystem>

#include "calibration/base/result.hpp"

namespace birdseye {

/// Where this machine's key and the keys that it knows are kept: BIRDSEYE_IDENTITY; a service's `identity` in its
/// STATE_DIRECTORY, as systemd names it; the user's `$XDG_CONFIG_HOME/birdseye/identity`, by default in ~/.config. An
/// error where the environment says none of these: ask only where a key is needed.
Result<std::filesystem::path> identity_folder();

/// Refuses the folder, or a file in it, where it belongs to another user than this program's or root: that user could
/// put other keys there. status: of the path.
Result<void> check_owner(const std::filesystem::path& path, const struct stat& status);

}  // namespace birdseye
