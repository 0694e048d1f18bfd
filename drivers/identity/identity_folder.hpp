#pragma once

#include <filesystem>

#include "calibration/base/result.hpp"

namespace birdseye {

/// Where this machine's key and the keys that it knows are kept: BIRDSEYE_IDENTITY; a service's `identity` in its
/// STATE_DIRECTORY, as systemd names it; the user's `$XDG_CONFIG_HOME/birdseye/identity`, by default in ~/.config. An
/// error where the environment says none of these: ask only where a key is needed.
Result<std::filesystem::path> identity_folder();

}  // namespace birdseye
