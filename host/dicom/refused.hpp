#pragma once

#include <fmt/format.h>

#include <filesystem>
#include <string>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// The Error "path: why".
inline Error refused(Errc code, const std::filesystem::path& path, const std::string& why) {
  return {code, fmt::format("{}: {}", path.string(), why)};
}

}  // namespace birdseye::host
